// SPDX-License-Identifier: Apache-2.0
// The iteration of Wu & Chen without states.

#ifndef DLCS_CORE_ITERATION_REDUCED_ITERATION_H_
#define DLCS_CORE_ITERATION_REDUCED_ITERATION_H_

#include "core/context/solve_context.h"

namespace dlcs {

// LaplaceIteration() with context.choices.propagator: the effect of earlier windows on N x comes from the kernel's
// ConvolutionHistory, and each iteration is one response of the kernel. Windows end with their run.
bool ReducedIteration(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_REDUCED_ITERATION_H_
