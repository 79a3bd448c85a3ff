// SPDX-License-Identifier: Apache-2.0
// The fixed point of the iteration, marched.

#ifndef DLCS_CORE_STEPPING_EXPONENTIAL_INTEGRATOR_H_
#define DLCS_CORE_STEPPING_EXPONENTIAL_INTEGRATOR_H_

#include "core/context/solve_context.h"

namespace dlcs {

// Marches one LCP(·, M + K_0) a step with exact exponentials of A: exp-PL where y is Lipschitz (second order, the same
// answer as LaplaceIteration() to rounding), exp-PC elsewhere (first order). See core/discretization/scheme.h.
// Returns whether the end was reached. One thread.
bool ExponentialIntegrator(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_EXPONENTIAL_INTEGRATOR_H_
