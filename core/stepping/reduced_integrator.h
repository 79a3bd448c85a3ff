// SPDX-License-Identifier: Apache-2.0
// The exponential integrator without states.

#ifndef DLCS_CORE_STEPPING_REDUCED_INTEGRATOR_H_
#define DLCS_CORE_STEPPING_REDUCED_INTEGRATOR_H_

#include "core/context/solve_context.h"

namespace dlcs {

// ExponentialIntegrator() with context.choices.propagator: one LCP(q, M + K_0) per step, where the effect of earlier y
// comes from the kernel's ConvolutionHistory. The same solution as with dense matrices, up to rounding.
bool IntegrateReduced(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_REDUCED_INTEGRATOR_H_
