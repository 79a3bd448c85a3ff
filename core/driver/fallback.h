// SPDX-License-Identifier: Apache-2.0
// A second try where the first choice failed and another one was open.

#ifndef DLCS_CORE_DRIVER_FALLBACK_H_
#define DLCS_CORE_DRIVER_FALLBACK_H_

#include "absl/status/statusor.h"
#include "core/driver/grid_solve.h"
#include "core/problem/observer.h"
#include "core/problem/solution.h"

namespace dlcs {

// Whether a first try that loses the least element would be replaced. (Those of event_driven leave no checkpoints.)
bool MayFallBack(const Task& task);

// What `solution`, the first try of `task`, is to be replaced by; mostly itself. Two things are tried again, each said
// in a warning of `report` and told to `observer` as a new analysis, with task.plan changed to what was done:
// - the least element was lost, and neither the rule nor the options ask for it: coupled steps, any solution of theirs;
// - event_driven, chosen and not asked for, missed the error: steps without events, kept if they err less.
// Errors: as SolveAsAsked().
absl::StatusOr<Solution> FallBack(Task& task, AnalysisReport& report, Observer& observer, Solution solution);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_FALLBACK_H_
