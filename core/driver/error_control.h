// SPDX-License-Identifier: Apache-2.0
// Chooses steps for a given error tolerance, and estimates the error for given steps.

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

// The solves that EstimateError() and SolveAsAsked() are made of, for any kind of problem.
struct SystemSolves {
  double horizon = 0;
  std::vector<double> break_points;
  double expected_order = 2;
  bool event_driven_serves = true;  // it may be recommended
  TrialSolves trials;
  // Returns the changes of x within the steps that pairs switch in; see SwitchChanges(). Empty if that is not known.
  std::function<ComponentErrors(const Solution&)> at_switches = {};
  // Returns the grid of the first trial for a grid of equal steps; empty if that is the same.
  std::function<Grid(const Grid&)> grade = {};
  // Of all trials together, if the error tolerance is the default one.
  Index most_default_steps = Options::kMaxDefaultSteps;
};

// Estimates the error of `solution` on `grid` by solves with twice and four times the step; with half the step if one
// of those fails or their differences show no order.
absl::Status CompareSteps(const SystemSolves& system, const Grid& grid, Solution& solution);

// Sets the final termination and message of `solution` after the trials. If the tolerance was the default one
// (`by_default`) and was missed, the solution still counts as reached, with its larger error. A tolerance set by the
// caller that was missed makes the solve fail.
void ConcludeTrials(const SystemSolves& system, const ControlledSolution& result, bool by_default, Solution& solution);

// Runs trials with more and more steps until the error is below options.error_tolerance. `by_default`: the tolerance is
// the default one, and the work is bounded.
absl::StatusOr<ControlledSolution> TrySteps(const SystemSolves& system, Options options, Index most_steps,
                                            bool by_default, std::vector<double>& wanted);

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
