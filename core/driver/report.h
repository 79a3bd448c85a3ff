// SPDX-License-Identifier: Apache-2.0
// The analysis that a solve reports before its first step, and the solution if there is no first step.

#ifndef DLCS_CORE_DRIVER_REPORT_H_
#define DLCS_CORE_DRIVER_REPORT_H_

#include <string>
#include <vector>

#include "core/driver/plan.h"
#include "core/problem/observer.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// The report of `plan`: the class of M, the method, the number of steps, and warnings.
AnalysisReport ReportOn(const Problem& problem, const Options& options, const Plan& plan);

// The solution of a problem whose `plan` holds a refusal: the termination and its reason, without a trajectory.
Solution Refusal(const Problem& problem, const Plan& plan, const AnalysisReport& report);

// The solution of a solve that was stopped during planning: kCancelled, without a trajectory.
Solution StoppedBeforeTheStart(Index num_states, Index num_constraints);

// Adds a warning if time_stepping with `step` solves LCPs with a matrix M^h that is not of the class of M by which y is
// selected. Needs all principal minors, and so checks at most 20 constraints.
void WarnOfCoupledClass(const Problem& problem, const Options& options, const Plan& plan, double step,
                        std::vector<std::string>& warnings);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_REPORT_H_
