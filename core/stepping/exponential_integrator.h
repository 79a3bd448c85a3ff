// SPDX-License-Identifier: Apache-2.0
// Time stepping with exact exponentials of A, whose solution is the fixed point of the Laplace iteration.

#ifndef DLCS_CORE_STEPPING_EXPONENTIAL_INTEGRATOR_H_
#define DLCS_CORE_STEPPING_EXPONENTIAL_INTEGRATOR_H_

#include "core/context/solve_context.h"

namespace dlcs {

// Solves one LCP(q, M + K_0) per step, with exact exponentials of A: exp-PL where y is Lipschitz (second order, the
// same answer as LaplaceIteration() to rounding), exp-PC elsewhere (first order). See core/discretization/scheme.h.
// Returns whether the end was reached. One thread.
bool ExponentialIntegrator(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_EXPONENTIAL_INTEGRATOR_H_
