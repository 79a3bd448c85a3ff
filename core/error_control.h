// SPDX-License-Identifier: Apache-2.0
// Steps for an error that is asked for, and errors of steps that are.

#ifndef DLCS_CORE_ERROR_CONTROL_H_
#define DLCS_CORE_ERROR_CONTROL_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/grid_solve.h"
#include "core/observer.h"
#include "core/solution.h"

namespace dlcs {

// Solves on the grid of the plan; or, where an error is asked for of a method that takes its steps from a grid, on
// steps as short as that needs (core/methods/step_control.h), the grid saying only where output is wanted. Errors: as
// SolveOnGrid().
absl::StatusOr<Solution> SolveAsAsked(Task& task, Observer& observer);

// Estimates the error of the converged `solution` where it has no estimate: from a second solve on half the step, for a
// method of order p the difference times 2^p / (2^p - 1). Says so in its accuracy where that one ends early. Errors: as SolveOnGrid(). Cost: twice that of the solve.
absl::Status EstimateError(Task& task, Solution& solution);

}  // namespace dlcs

#endif  // DLCS_CORE_ERROR_CONTROL_H_
