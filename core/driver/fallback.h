// SPDX-License-Identifier: Apache-2.0
// A second solve with another method, if the first choice failed and the caller did not fix the method.

#ifndef DLCS_CORE_DRIVER_FALLBACK_H_
#define DLCS_CORE_DRIVER_FALLBACK_H_

#include "absl/status/statusor.h"
#include "core/driver/grid_solve.h"
#include "core/problem/observer.h"
#include "core/problem/solution.h"

namespace dlcs {

// Whether the first solve would be replaced if it lost the least element. (A replaced solve by event_driven makes no
// checkpoints anyway.)
bool MayFallBack(const Task& task);

// Returns `solution`, the result of the first solve of `task`, or that of a second solve. There are two cases for a
// second solve. Each adds a warning to `report`, reports it to `observer` as a new analysis, and changes task.plan:
// - The least element was lost, and neither the rule nor the options ask for it: coupled steps with any solution.
// - event_driven, chosen by the engine, missed the error: steps without events, whose solution is kept if its estimated
//   error is smaller and the two do not differ by more than both estimates.
// Errors: as SolveAsAsked().
absl::StatusOr<Solution> FallBack(Task& task, AnalysisReport& report, Observer& observer, Solution solution);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_FALLBACK_H_
