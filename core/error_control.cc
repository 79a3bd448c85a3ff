// SPDX-License-Identifier: Apache-2.0
#include "core/error_control.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/linalg/norms.h"
#include "core/methods/event_located.h"
#include "core/methods/step_control.h"
#include "core/number_text.h"

namespace dlcs {
namespace {

// Trial solves for a step tell how far they have come, but not their iterates: those of several steps make no table.
class WindowObserver final : public Observer {
 public:
  explicit WindowObserver(Observer& observer) : observer_(observer) {}
  void OnWindowStarted(const WindowReport& window) override { observer_.OnWindowStarted(window); }
  void OnWindowFinished(const WindowOutcome& outcome) override { observer_.OnWindowFinished(outcome); }

 private:
  Observer& observer_;
};

// What the finest trial says of itself.
void TellError(const Task& task, const ControlledSolution& result, Solution& solution) {
  if (solution.termination != Termination::kReachedEnd) return;
  solution.accuracy.source = AccuracySource::kControlled;
  solution.accuracy.asked = task.options.error_tolerance;
  solution.accuracy.error = NanMax(result.error, Accuracy::kLeastError);
  const std::string seen = std::to_string(solution.cost.steps) + " steps, whose error is estimated as " +
                           FormatNumber(result.error) + " of the size of x (order seen " +
                           FormatNumber(std::round(10 * result.order) / 10) + ")";
  if (result.reached) {
    solution.message = "Reached T = " + FormatNumber(task.problem.horizon) + " in " + seen + ".";
    return;
  }
  solution.termination = Termination::kIterationLimit;
  solution.message = "An error of " + FormatNumber(task.options.error_tolerance) +
                     " was asked for, which more steps than are allowed would take: the trajectory is that of " + seen +
                     ". Take event-located, or allow a larger error.";
}

// Steps as short as options.error_tolerance needs; a grid that was asked for is where output is wanted.
absl::StatusOr<Solution> SolveWithinError(Task& task, Observer& observer) {
  constexpr Index kFirstTrialSteps = 64;
  constexpr Index kMostTrialSteps = Index{1} << 22;
  constexpr Index kMostPaperSteps = 2048;  // paper_iteration costs the square of their number
  constexpr Index kNodesKept = 4096;
  Options options = task.options;
  if (!options.has_grid()) options.num_steps = kFirstTrialSteps;
  Grid grid = MakeGrid(task.problem.horizon, BreakPoints(task.problem), options);
  std::vector<double> wanted;
  for (const Index node : grid.output_nodes) wanted.push_back(grid.times[node]);
  grid.output_nodes.resize(grid.times.size());  // trials are compared at all of them
  std::iota(grid.output_nodes.begin(), grid.output_nodes.end(), Index{0});

  const bool is_paper = task.plan.method.method == Method::kPaperIteration;
  if (is_paper) {
    // No halving of steps shows the error of the contour, e^{-2.06 √P}: it gets a thirtieth of the tolerance.
    const double root = std::log(30 / options.error_tolerance) / 2.06;
    task.options.num_contour_nodes = std::max(options.num_contour_nodes, static_cast<Index>(std::ceil(root * root)));
  }
  const StepControl control{.tolerance = options.error_tolerance,
                            .y_counts = IsAlwaysLipschitz(task.plan.selection),
                            .most_steps = is_paper ? kMostPaperSteps : kMostTrialSteps,
                            .nodes_kept = task.options.has_grid() ? 0 : kNodesKept};
  WindowObserver windows(observer);
  auto result = SolveToTolerance(task.problem, control, std::move(grid),
                                 [&](const Grid& trial) { return SolveOnGrid(task, trial, windows); });
  if (!result.ok()) return result.status();
  Solution& solution = result->solution;
  if (solution.contour && solution.contour->nodes > 0) {
    result->error = NanMax(result->error, std::pow(10, solution.contour->log10_error));
    result->reached = result->reached && result->error <= options.error_tolerance;
  }
  TellError(task, *result, solution);
  if (options.output_times_only || task.options.has_grid()) KeepTimes(wanted, solution);
  return std::move(solution);
}

}  // namespace

absl::StatusOr<Solution> SolveAsAsked(Task& task, Observer& observer) {
  const MethodChoice& method = task.plan.method;
  const bool controls_its_steps = method.method == Method::kEventLocated || method.inelastic_impact;
  if (task.options.error_tolerance > 0 && !controls_its_steps) return SolveWithinError(task, observer);
  return SolveOnGrid(task, task.plan.grid, observer, task.resume);
}

absl::Status EstimateError(Task& task, Solution& solution) {
  if (solution.termination != Termination::kReachedEnd) return absl::OkStatus();
  if (solution.accuracy.source != AccuracySource::kNotEstimated) return absl::OkStatus();
  const Method method = task.plan.method.method;
  Observer silent;
  const auto finer = SolveOnGrid(task, Halve(task.plan.grid), silent);
  if (!finer.ok()) return finer.status();
  solution.cost.seconds_total = finer->cost.seconds_total;  // both count from the same start
  if (finer->termination != Termination::kReachedEnd) {
    solution.accuracy.note = std::string("Not estimated: with half the step the solve ended as ") +
                             TerminationName(finer->termination) + ". " + finer->message;
    return absl::OkStatus();
  }
  const bool first_order_steps =
      method == Method::kTimeStepping && !task.options.average_y && !task.plan.method.two_stages;
  const bool second_order = !first_order_steps && IsAlwaysLipschitz(task.plan.selection);
  const double factor = second_order ? 4.0 / 3 : 2.0;
  solution.accuracy.source = AccuracySource::kCompared;
  solution.accuracy.error = NanMax(factor * RelativeDifference(solution.x, finer->x), Accuracy::kLeastError);
  if (task.plan.method.inelastic_impact) {
    solution.warnings.push_back(
        "The estimated error is an order of magnitude only: impacts happen at nodes, up to a step late, and how late "
        "does not shrink evenly with the step.");
  }
  return absl::OkStatus();
}

}  // namespace dlcs
