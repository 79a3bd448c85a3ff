// SPDX-License-Identifier: Apache-2.0
// Periodic steady states by Newton's method.

#ifndef DLCS_CORE_PERIODIC_PERIODIC_H_
#define DLCS_CORE_PERIODIC_PERIODIC_H_

#include <stop_token>

#include "absl/status/statusor.h"
#include "core/problem/observer.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

class SetupCache;

// Finds x(0) = x(P) for the period P = options.period of the sources, and returns the solution on [0, P], with
// Solution::periodic. With Options::kFindPeriod P is unknown: the solution is followed from x0 up to T first, and where
// it returns to a state near an earlier one is the first guess of an oscillation.
//
// Newton's method is applied to x0 - Φ(x0) = 0, where Φ follows event_driven over one period, with the monodromy matrix
// dΦ/dx0 of core/event_driven/flow_derivative.h. A step is accepted if it shortens the step of the same matrix from its
// end (the natural monotonicity test), which depends on no norm of the residual. Where the method makes no progress,
// the solution from x0 is followed for as many periods as it took, and it begins again from there. For an unknown P the
// phase is fixed by x'(0)'(x0 - its last value) = 0.
//
// With the rule kHistory the start is x and the branch of solutions that y is on; both must return.
//
// The error is that of (I - dΦ/dx0)⁻¹ times the residual and the errors of a period, and joins the accuracy of the
// solution, so that the verdict contains it. If no periodic solution is found, or it is not isolated, the result is a
// solution that says why (kNotPeriodic), with what is known about the last period. `options` must have a period, the
// method kEventDriven, and have passed CheckPeriod(). Errors: as core/solve.h. Cost: 3 to 7 solves of a period, with m
// more columns each; the last one is for the errors of the multipliers (core/periodic/stability.h).
absl::StatusOr<Solution> SolvePeriodic(const Problem& problem, const Options& options, Observer& observer,
                                       std::stop_token stop, SetupCache* setups);

}  // namespace dlcs

#endif  // DLCS_CORE_PERIODIC_PERIODIC_H_
