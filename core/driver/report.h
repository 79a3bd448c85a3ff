// SPDX-License-Identifier: Apache-2.0
// What a solve says of itself before its first step, and where it is not begun.

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

// What was found out, what will be done, and what to beware of.
AnalysisReport ReportOn(const Problem& problem, const Options& options, const Plan& plan);

// The answer of a plan that is refused.
Solution Refusal(const Problem& problem, const Plan& plan, const AnalysisReport& report);

// The answer of a solve that was stopped while it was planned.
Solution StoppedBeforeTheStart(Index num_states, Index num_constraints);

// Warns where time_stepping with `step` solves LCPs whose matrix M^h has lost the class that M has, on which y rests.
// Looks at all principal minors, and so at no more than 20 constraints.
void WarnOfCoupledClass(const Problem& problem, const Options& options, const Plan& plan, double step,
                        std::vector<std::string>& warnings);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_REPORT_H_
