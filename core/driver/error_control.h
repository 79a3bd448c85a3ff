// SPDX-License-Identifier: Apache-2.0
// Solves with steps as short as an error tolerance requires, and estimates the error of given steps.

#ifndef DLCS_CORE_DRIVER_ERROR_CONTROL_H_
#define DLCS_CORE_DRIVER_ERROR_CONTROL_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/driver/grid_solve.h"
#include "core/problem/observer.h"
#include "core/problem/solution.h"

namespace dlcs {

// Sets options.error_tolerance to Options::kDefaultErrorTolerance if neither steps nor an error are given. Returns
// whether it did.
bool FillInDefaultError(Options& options);

// Solves on the grid of the plan. If an error tolerance is set and the method takes its steps from a grid, the steps
// are found by trials (core/driver/step_control.h), and the grid only gives the output times. Errors: as SolveOnGrid().
absl::StatusOr<Solution> SolveAsAsked(Task& task, Observer& observer);

// Estimates the error of `solution`, which reached T on the grid of the plan, unless it has an estimate already. Its
// accuracy says how the error was estimated, or why not. Errors: as SolveOnGrid(). Cost: three quarters of that of the
// solve.
absl::Status EstimateError(Task& task, Solution& solution);

// Reports the progress of all trials together, as windows up to a time that never decreases. Iterates are not reported,
// since those of different steps do not belong together.
class TrialObserver final : public Observer {
 public:
  TrialObserver(Observer& observer, double horizon) : observer_(observer), horizon_(horizon) {}
  void NextTrial() { ++trial_; }
  void OnWindowStarted(const WindowReport& window) override;
  void OnWindowFinished(const WindowOutcome& outcome) override;

 private:
  double Overall(double time) const;

  Observer& observer_;
  double horizon_;
  int trial_ = 0;  // from 1
};

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_ERROR_CONTROL_H_
