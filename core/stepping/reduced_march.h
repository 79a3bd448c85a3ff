// SPDX-License-Identifier: Apache-2.0
// The exponential integrator without states.

#ifndef DLCS_CORE_STEPPING_REDUCED_MARCH_H_
#define DLCS_CORE_STEPPING_REDUCED_MARCH_H_

#include "core/context/solve_context.h"

namespace dlcs {

// ExponentialIntegrator() with context.propagator: one LCP(·, M + K_0) a step, in which the past of y comes from the
// memory of the kernel. The same answer as with dense matrices, to rounding.
bool ReducedMarch(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_REDUCED_MARCH_H_
