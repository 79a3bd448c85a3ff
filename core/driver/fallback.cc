// SPDX-License-Identifier: Apache-2.0
#include "core/driver/fallback.h"

#include <cmath>
#include <string>
#include <utility>

#include "core/context/component_errors.h"
#include "core/driver/error_control.h"
#include "core/driver/step_control.h"
#include "core/problem/verdict.h"

namespace dlcs {
namespace {

// Whether the options need y as a function of x. Coupled steps do not compute that.
bool NeedsFunction(const Options& options) {
  return options.method == Method::kLaplaceIteration || options.method == Method::kWuChenIteration ||
         (options.method == Method::kTimeStepping && (options.average_y || options.step_solver == StepSolver::kNewton));
}

bool AllowsCoupling(const Task& task) {
  return task.problem.rule == SolutionRule::kAuto && !NeedsFunction(task.options);
}

bool MayCouple(const Task& task) { return task.lost_least_element && AllowsCoupling(task); }

// Whether steps without events may do better: if event location did not reach T, if the certificate contradicts its
// answer, or if it needed coupled steps and missed the tolerance. If it reached T in its modes, it misses the tolerance
// by rounding only, and steps would too.
bool MissedByEvents(const Task& task, const Solution& solution) {
  if (task.options.method != Method::kAuto || solution.method != Method::kEventDriven) return false;
  if (task.plan.selection == Selection::kHistory) return false;
  const bool reached = solution.termination == Termination::kReachedEnd;
  if (!reached && solution.termination != Termination::kIterationLimit) return false;
  if (!reached && !std::isnan(solution.failure_time)) return true;
  const bool is_accurate = solution.accuracy.error <= task.options.error_tolerance;
  return is_accurate ? !JudgeSolution(solution).success : solution.cost.coupled_steps > 0;
}

// If both reached T, the one with the smaller error is better. A solution up to a time before T is better than one up
// to T that is not accurate.
bool IsBetter(const Solution& second, const Solution& first) {
  if (second.termination != Termination::kReachedEnd) return false;
  const bool second_is_usable = JudgeSolution(second).success;
  if (first.termination != Termination::kReachedEnd) return second_is_usable;
  if (JudgeSolution(first).success != second_is_usable) return second_is_usable;
  return second.accuracy.error < first.accuracy.error;
}

// Whether the two differ by more than their estimated errors allow. Two step lengths that both miss a fast motion agree
// with each other, so their estimate does not show the error.
bool Contradict(const Problem& problem, const Solution& by_events, const Solution& stepped) {
  const double estimates = by_events.accuracy.error + stepped.accuracy.error;
  if (!std::isfinite(estimates)) return false;
  const ComponentValues sizes = SizesOf(problem, by_events, /*y_counts=*/false);
  const ComponentValues differences = DifferencesBetween(by_events, stepped, sizes, stepped.step);
  return Beyond(differences, RoundingOfTerms(problem, sizes)).LargestRelative(sizes) > kSafetyOfComparison * estimates;
}

// Solves by the method that is chosen with `choose_by`, after `first`; returns `first` if no other method applies.
absl::StatusOr<Solution> SolveAgain(Task& task, const Options& choose_by, const std::string& how, Solution first,
                                    AnalysisReport& report, Observer& observer) {
  ChooseAgain(task.problem, choose_by, task.setups, task.plan);
  task.leaves_checkpoints = false;  // a resumed solve starts with the first method again
  task.resume = nullptr;
  if (task.plan.is_refused()) {
    report.warnings.push_back("Not solved again " + how + ": " + task.plan.refusal());
    return first;
  }
  report.warnings.push_back(first.message + " Solved again " + how + ".");
  report.method = task.plan.method.method;
  report.reason = task.plan.method.reason;
  observer.OnAnalysis(report);
  return SolveAsAsked(task, observer);
}

}  // namespace

bool MayFallBack(const Task& task) { return task.plan.selection == Selection::kLeastElement && AllowsCoupling(task); }

absl::StatusOr<Solution> FallBack(Task& task, AnalysisReport& report, Observer& observer, Solution solution) {
  if (MayCouple(task)) {
    task.plan.selection = Selection::kAny;
    auto coupled = SolveAgain(task, task.options, "by coupled steps, with any of their solutions", std::move(solution),
                              report, observer);
    if (!coupled.ok()) return coupled;
    solution = *std::move(coupled);
  }
  if (MissedByEvents(task, solution)) {
    task.follows_event_driven = true;
    Options without_events = task.options;
    without_events.error_tolerance = 0;
    auto stepped = SolveAgain(task, without_events, "by steps without events", solution, report, observer);
    if (!stepped.ok()) return stepped;
    const bool came_to_end = std::isnan(solution.failure_time);
    if (came_to_end && Contradict(task.problem, solution, *stepped)) {
      solution.warnings.push_back(
          "Steps without events differ from this event-driven solution by more than the estimated errors of both.");
    } else if (IsBetter(*stepped, solution)) {
      solution = *std::move(stepped);
    } else {
      solution.warnings.push_back("Steps without events were not more accurate: this is the event-driven solution.");
    }
  }
  return solution;
}

}  // namespace dlcs
