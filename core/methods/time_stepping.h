// SPDX-License-Identifier: Apache-2.0
// The θ-scheme of Chen & Xiang by substitution.

#ifndef DLCS_CORE_METHODS_TIME_STEPPING_H_
#define DLCS_CORE_METHODS_TIME_STEPPING_H_

#include "core/methods/solve_context.h"

namespace dlcs {

// Marches (1.3) of [Chen & Xiang 2013], one LCP(q, M^h) a step with M^h = h N (I - h(1-θ)A)⁻¹ B + M. It asks nothing
// of M, so it solves every class; first order. The solution rule is judged on M: where M^h leaves the
// class of M, the solution carries a warning. Returns whether the end was reached. One thread.
bool TimeStepping(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_TIME_STEPPING_H_
