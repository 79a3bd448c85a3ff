// SPDX-License-Identifier: Apache-2.0
// Steps for an error that is asked for, and errors of steps that are.

#ifndef DLCS_CORE_DRIVER_ERROR_CONTROL_H_
#define DLCS_CORE_DRIVER_ERROR_CONTROL_H_

#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/driver/grid_solve.h"
#include "core/driver/step_control.h"
#include "core/problem/observer.h"
#include "core/problem/solution.h"

namespace dlcs {

// `options` as they are meant: where neither steps nor an error are given, the error is
// Options::kDefaultErrorTolerance. True where that was filled in.
bool FillInDefaultError(Options& options);

// Solves on the grid of the plan; or, where an error is asked for of a method that takes its steps from a grid, on
// steps as short as that needs (core/driver/step_control.h), the grid saying only where output is wanted. Errors: as
// SolveOnGrid().
absl::StatusOr<Solution> SolveAsAsked(Task& task, Observer& observer);

// Estimates the error of `solution`, which reached T on the grid of the plan, where it has no estimate. Says in its
// accuracy how, or why not. Errors: as SolveOnGrid(). Cost: three quarters of that of the solve.
absl::Status EstimateError(Task& task, Solution& solution);

// What EstimateError() and SolveAsAsked() do, for any kind of problem.
struct SystemSolves {
  double horizon = 0;
  std::vector<double> break_points;
  double expected_order = 2;
  TrialSolves trials;
  Index most_default_steps = Options::kMostDefaultSteps;  // of all trials together, where nobody asked for the error
};

// Compares `solution` on `grid` with solves of twice and four times the step; with half of it where that fails or shows
// nothing.
absl::Status CompareSteps(const SystemSolves& system, const Grid& grid, Solution& solution);

// The default error may be missed, and is then what `solution` has; one that was asked for may not. Says so in its
// message.
void ConcludeTrials(const SystemSolves& system, const ControlledSolution& result, bool by_default, Solution& solution);

// Trials from a few steps on, for the error that `options` ask for. `by_default`: nobody asked for it, and the work is
// bounded.
absl::StatusOr<ControlledSolution> TrySteps(const SystemSolves& system, Options options, Index most_steps,
                                            bool by_default, std::vector<double>& wanted);

// Trials for a step report how far they have come altogether, as windows up to a time that never falls, and no
// iterates: those of several steps make no table.
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
