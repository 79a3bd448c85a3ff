// SPDX-License-Identifier: Apache-2.0

#include "core/driver/step_comparison.h"

#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "core/context/sizes.h"
#include "core/driver/grid_solve.h"
#include "core/driver/propagator_choice.h"
#include "core/driver/source_resolution.h"
#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"
#include "core/problem/verdict.h"

namespace dlcs {
namespace {

// The reason why there is nothing to compare with on another grid.
std::string NoComparison(const std::string& with, const Solution& other) {
  return "No estimate: with " + with + " the solve ended as " + TerminationName(other.termination) + ". " +
         other.message;
}

bool Reached(const Solution& solution) { return solution.termination == Termination::kReachedEnd; }

void SetCompared(TrajectoryErrors errors, std::string note, Accuracy& accuracy) {
  accuracy.source = AccuracySource::kCompared;
  accuracy.errors = std::move(errors);
  accuracy.note = std::move(note);
}

// What changes in the last digits of the data make of the solution on `grid`, beside `exact`. If that cannot be known,
// the rounding of its terms.
absl::StatusOr<ComponentValues> RoundingOf(const TrialSolves& trials, const Grid& grid, const Solution& exact,
                                           const ComponentValues& sizes) {
  if (trials.solve_rounded) {
    const absl::StatusOr<Solution> rounded = trials.solve_rounded(grid, kRoundedUlps);
    if (!rounded.ok()) return rounded.status();
    if (Reached(*rounded)) {
      return WithRoundingOfRows(trials.compare(*rounded, exact, sizes), trials.rounding_of_terms(sizes));
    }
  }
  return trials.rounding_of_terms(sizes);
}

// Raises `errors` to what a switch inside a step may leave behind. A method with fixed steps moves it to a node, and
// grids that place it alike do not show that. If y jumps, x may be off by the jump of B y times the step h; if y has a
// kink, B y is off by h/8 times the change of its slope at most. `other` has steps of h / `ratio`.
void CountSwitches(const SystemSolves& system, double ratio, const Solution& other, const ComponentValues& sizes,
                   ComponentValues& errors) {
  if (!system.trials.at_switches) return;
  const bool only_kinks = system.expected_order > 1;
  errors.RaiseTo(system.trials.at_switches(other, sizes), only_kinks ? ratio * ratio / 8 : ratio);
}

// Estimates the error by solves with twice and four times the step. Returns false, with the reason in the accuracy, if
// they show nothing.
absl::StatusOr<bool> CompareWithCoarser(const SystemSolves& system, const Grid& grid, Solution& solution) {
  const Grid twice = WithOtherSteps(grid, 2, system.nodes_compared);
  const Grid four_times = WithOtherSteps(grid, 4, system.nodes_compared);
  // If the nodes that must stay are dense, hardly any step becomes longer.
  if (5 * four_times.num_steps() > 3 * grid.num_steps()) return false;
  absl::StatusOr<Solution> longer = system.trials.solve(twice);
  if (!longer.ok()) return longer.status();
  if (!Reached(*longer)) {
    solution.accuracy.note = NoComparison("twice the step", *longer);
    return false;
  }
  absl::StatusOr<Solution> longest = system.trials.solve(four_times);
  if (!longest.ok()) return longest.status();
  const TrialSolves& trials = system.trials;
  const ComponentValues sizes = trials.sizes(solution);
  const absl::StatusOr<ComponentValues> rounding =
      Reached(*longest) ? RoundingOf(trials, four_times, *longest, sizes) : RoundingOf(trials, twice, *longer, sizes);
  if (!rounding.ok()) return rounding.status();
  Convergence convergence(system.expected_order);
  const auto add = [&](const Solution& coarse, const Solution& fine) {
    ComponentValues differences = Beyond(trials.compare(coarse, fine, sizes), *rounding);
    const double relative = differences.LargestRelative(sizes);
    convergence.Add(std::move(differences), relative);
  };
  std::string note = "Compared with " + StepsText(twice.num_steps());
  if (Reached(*longest)) {
    add(*longest, *longer);
    note += " and " + StepsText(four_times.num_steps());
  }
  add(*longer, solution);
  ComponentValues errors = convergence.errors(kSafetyOfComparison);
  CountSwitches(system, 0.5, *longer, sizes, errors);
  SetCompared(ErrorsOf(sizes, errors, *rounding), note + ".", solution.accuracy);
  return true;
}

// Estimates the error by solves with half the step and a quarter of it: for few steps, or if longer ones are not
// possible.
absl::Status CompareWithFiner(const SystemSolves& system, const Grid& grid, Solution& solution) {
  constexpr Index kFewSteps = 64;
  const TrialSolves& trials = system.trials;
  const Grid half = Halve(grid);
  absl::StatusOr<Solution> shorter = trials.solve(half);
  if (!shorter.ok()) return shorter.status();
  if (!Reached(*shorter)) {
    solution.accuracy.note = NoComparison("half the step", *shorter);
    return absl::OkStatus();
  }
  const ComponentValues sizes = trials.sizes(solution);
  const absl::StatusOr<ComponentValues> rounding = RoundingOf(trials, grid, solution, sizes);
  if (!rounding.ok()) return rounding.status();
  ComponentValues errors = Beyond(trials.compare(solution, *shorter, sizes), *rounding);
  Convergence convergence(system.expected_order);
  convergence.Add(errors, errors.LargestRelative(sizes));
  std::string note = "Compared with " + StepsText(half.num_steps());
  if (grid.num_steps() < kFewSteps) {
    const Grid quarter = Halve(half);
    absl::StatusOr<Solution> shortest = trials.solve(quarter);
    if (!shortest.ok()) return shortest.status();
    if (Reached(*shortest)) {
      ComponentValues differences = Beyond(trials.compare(*shorter, *shortest, sizes), *rounding);
      const double relative = differences.LargestRelative(sizes);
      convergence.Add(std::move(differences), relative);
      note += " and " + StepsText(quarter.num_steps());
    }
  }
  errors += convergence.errors(kSafetyOfComparison);
  CountSwitches(system, 2, *shorter, sizes, errors);
  SetCompared(ErrorsOf(sizes, errors, *rounding), note + ".", solution.accuracy);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ControlledSolution> TrySteps(const SystemSolves& system, Options options, Index most_steps,
                                            bool by_default, std::vector<double>& wanted) {
  const bool has_grid = options.has_grid();
  if (!has_grid) options.num_steps = kFirstTrialSteps;
  Grid grid = MakeGrid(system.horizon, system.break_points, options);
  for (const Index node : grid.output_nodes) wanted.push_back(grid.times[static_cast<std::size_t>(node)]);
  if (system.grade) grid = system.grade(grid);
  grid.output_nodes.resize(grid.times.size());  // trials are compared at all of them
  std::iota(grid.output_nodes.begin(), grid.output_nodes.end(), Index{0});
  const StepControl control{.options = options,
                            .expected_order = system.expected_order,
                            .most_steps = most_steps,
                            .most_steps_all = by_default ? system.most_default_steps : 0,
                            .nodes_kept = has_grid ? 0 : kNodesKept,
                            .whole_horizon = options.method == Method::kWuChenIteration};
  return SolveToTolerance(control, std::move(grid), system.trials);
}

void ConcludeTrials(const SystemSolves& system, const ControlledSolution& result, const Options& options,
                    bool by_default, Solution& solution) {
  if (!Reached(solution)) return;
  Accuracy& accuracy = solution.accuracy;
  accuracy.tolerance_is_default = by_default;
  accuracy.follows_tolerance = result.converges;
  const std::string steps = StepsText(solution.cost.steps);
  const std::string order = result.order ? "observed order " + FormatNumber(std::round(10 * *result.order) / 10) : "";
  accuracy.note = "The last of several solves, each with half the step of the one before" +
                  (order.empty() ? "" : "; " + order) + ".";
  solution.message = "Reached T = " + FormatNumber(system.horizon) + " in " + steps + ".";
  if (result.reached) return;
  // Grids that agree have not shown that they converge.
  if (ExcessOfTruncation(accuracy.errors, options, accuracy.tolerance) <= 1) {
    RaiseTruncation(2 * accuracy.tolerance, accuracy.errors);
  }
  solution.message +=
      by_default
          ? " The work allowed by default ended before the tolerance " + FormatNumber(accuracy.tolerance) +
                " was reached: set a tolerance or steps."
          : " The tolerance " + FormatNumber(accuracy.tolerance) + " needs more steps than are allowed" +
                (order.empty() ? "" : " (" + order + ")") + ". " +
                (system.event_driven_serves ? "Use event-driven, or allow a larger error." : "Allow a larger error.");
}

absl::Status CompareSteps(const SystemSolves& system, const Grid& grid, Solution& solution) {
  constexpr Index kMinSteps = 8;  // that can be doubled twice
  bool coarser_serve = false;
  try {
    if (grid.num_steps() >= kMinSteps) {
      const absl::StatusOr<bool> compared = CompareWithCoarser(system, grid, solution);
      if (!compared.ok()) return compared.status();
      coarser_serve = *compared;
    }
    if (!coarser_serve) {
      if (absl::Status status = CompareWithFiner(system, grid, solution); !status.ok()) return status;
    }
    if (solution.accuracy.source == AccuracySource::kCompared) {
      system.trials.follow_states(solution, solution.accuracy.errors);
      CountUnresolved(system.trials.unresolved(grid, solution), solution);
    }
    return absl::OkStatus();
  } catch (const Stopped&) {
    solution.accuracy.note = "No estimate: stopped on request before there was a solution to compare with.";
    return absl::OkStatus();
  }
}

}  // namespace dlcs
