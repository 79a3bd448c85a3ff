// SPDX-License-Identifier: Apache-2.0

#include "core/nonlinear/solve_nonlinear.h"

#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/context/sizes.h"
#include "core/context/solve_context.h"
#include "core/driver/error_control.h"
#include "core/driver/report.h"
#include "core/driver/source_resolution.h"
#include "core/driver/step_comparison.h"
#include "core/lcp/basis/tolerance.h"
#include "core/linalg/norms.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/nonlinear/nonlinear_context.h"
#include "core/nonlinear/splitting_iteration.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// What stays the same on every grid.
struct NonlinearTask {
  const NonlinearProblem& problem;
  Options options;
  Selection selection;
  Vector y_guess;
  Workers workers;
  std::stop_token stop;
  std::chrono::steady_clock::time_point started;
};

// A y for which g has a value at time 0: y = 0, unless a formula like log(y1) has none there.
Vector FirstGuess(const NonlinearProblem& problem, NonlinearFunctions& functions) {
  const Vector zero = Vector::Zero(problem.num_constraints());
  return functions.G(0, problem.x0, zero).allFinite() ? zero : Vector::Ones(problem.num_constraints()).eval();
}

// g_y with entries that may be rounding of its differences set to zero, so that its class can be determined.
Matrix WithoutNoise(Matrix jacobian) {
  const double noise = kSameResult * MaxAbs(jacobian);
  return (jacobian.array().abs() <= noise).select(0, jacobian);
}

// What was recorded before a stop is kept.
bool RunUnlessStopped(NonlinearContext& context) {
  try {
    return SplittingIteration(context);
  } catch (const Stopped&) {
    return context.FailCancelled(context.recorder.reached());
  }
}

Solution SolveOnGrid(NonlinearTask& task, NonlinearFunctions functions, const Grid& grid, Observer& observer) {
  Solution solution;
  solution.method = Method::kLaplaceIteration;
  solution.step = grid.longest_step;
  NonlinearContext context{
      .problem = task.problem,
      .options = task.options,
      .selection = task.selection,
      .y_guess = task.y_guess,
      .grid = grid,
      .functions = std::move(functions),
      .workers = task.workers,
      .observer = observer,
      .stop = task.stop,
      .recorder = Recorder(grid, task.problem.num_states(), task.problem.num_constraints(), solution),
      .solution = solution,
      .started = task.started};
  solution.cost.seconds_setup = context.Seconds();
  if (RunUnlessStopped(context)) {
    solution.termination = Termination::kReachedEnd;
    solution.message =
        "Reached T = " + FormatNumber(task.problem.horizon) + " in " + StepsText(solution.cost.steps) + ".";
  }
  context.recorder.Finish();
  solution.cost.seconds_total = context.Seconds();
  return solution;
}

// The part of f(t, x, y) and g(t, x, y), as functions of t alone, that steps do not see.
Unresolved UnresolvedOf(const NonlinearTask& task, const Grid& grid, const Solution& solution) {
  auto functions = NonlinearFunctions::Create(task.problem);
  if (!functions.ok()) return {};
  const double part = UnresolvedSources(grid, solution, [&](double t, Side side, Index column) {
    const double beside = side == Side::kRight ? t : std::nextafter(t, 0);
    Vector both(task.problem.num_states() + task.problem.num_constraints());
    const Vector x = solution.x.col(column), y = solution.y.col(column);
    both << functions->F(beside, x, y), functions->G(beside, x, y);
    return both;
  });
  return {.part = part};
}

// Solves on any grid, with functions of their own, and what to compare of them. `task` must outlive what is returned.
SystemSolves SolvesOf(NonlinearTask& task, Observer& observer) {
  return {.horizon = task.problem.horizon,
          .break_points = BreakPoints(task.problem),
          .expected_order = 2,
          .event_driven_serves = false,
          .trials = {.solve = [&task, &observer](const Grid& grid) -> absl::StatusOr<Solution> {
                       auto functions = NonlinearFunctions::Create(task.problem);
                       if (!functions.ok()) return functions.status();
                       return SolveOnGrid(task, *std::move(functions), grid, observer);
                     },
                     .sizes = [](const Solution& solution) { return SizesOf(solution); },
                     .rounding_of_terms = [](const ComponentValues& sizes) { return RoundingOfTerms(sizes); },
                     .compare = [](const Solution& coarse, const Solution& fine,
                                   const ComponentValues& sizes) { return DifferencesBetween(coarse, fine, sizes); },
                     .unresolved = [&task](const Grid& grid,
                                           const Solution& solution) { return UnresolvedOf(task, grid, solution); },
                     .fits = {}}};
}

// What the trajectory and the columns of a window on `steps` steps take.
double PredictBytes(const NonlinearProblem& problem, double steps, double outputs) {
  const auto numbers = static_cast<double>(problem.num_states() + 2 * problem.num_constraints() + 2);
  return sizeof(double) * (steps + 1 + outputs * numbers);
}

// Solves by trials, for the tolerance of the options or the default one.
absl::StatusOr<Solution> SolveWithinError(NonlinearTask& task, bool by_default, Observer& observer) {
  TrialObserver windows(observer, task.problem.horizon);
  SystemSolves system = SolvesOf(task, windows);
  system.trials.solve = [&, solve = system.trials.solve](const Grid& grid) {
    windows.NextTrial();
    return solve(grid);
  };
  system.trials.fits = [&](const Grid& grid) {
    const double steps = 2 * static_cast<double>(grid.num_steps());
    return 2 * PredictBytes(task.problem, steps, static_cast<double>(grid.output_nodes.size())) <=
           task.options.max_memory;
  };
  constexpr Index kMaxTrialSteps = Index{1} << 20;
  std::vector<double> wanted;
  auto result = TrySteps(system, task.options, kMaxTrialSteps, by_default, wanted);
  if (!result.ok()) return result.status();
  ConcludeTrials(system, *result, task.options, by_default, result->solution);
  JudgeComponents(
      task.options, [] { return AllSizesBeside(); }, result->solution.accuracy);
  if (task.options.output_times_only || task.options.has_grid()) KeepTimes(wanted, result->solution);
  return std::move(result->solution);
}

// On the grid that was given, with an estimate of the error where it is wanted and fits.
absl::StatusOr<Solution> SolveOnGivenSteps(NonlinearTask& task, NonlinearFunctions functions, const Grid& grid,
                                           Observer& observer) {
  Solution solution = SolveOnGrid(task, std::move(functions), grid, observer);
  if (solution.termination != Termination::kReachedEnd) return solution;
  if (!task.options.estimate_error) {
    solution.accuracy.note = "No estimate was requested.";
    return solution;
  }
  const auto steps = static_cast<double>(grid.num_steps()), outputs = static_cast<double>(grid.output_nodes.size());
  if (1.5 * PredictBytes(task.problem, steps, outputs) > task.options.max_memory) {
    solution.accuracy.note =
        "No estimate: a second solve does not fit into the memory allowed (--max-memory) together with the trajectory.";
    return solution;
  }
  Observer silent;
  if (absl::Status status = CompareSteps(SolvesOf(task, silent), grid, solution); !status.ok()) return status;
  if (solution.accuracy.source != AccuracySource::kNotEstimated) {
    JudgeComponents(
        task.options, [] { return AllSizesBeside(); }, solution.accuracy);
  }
  solution.cost.seconds_total = SecondsSince(task.started);
  return solution;
}

Solution Refused(const NonlinearProblem& problem, const AnalysisReport& report, std::string why) {
  Solution refused;
  refused.termination = Termination::kUnsupported;
  refused.message = std::move(why);
  refused.failure_time = 0;
  refused.method = Method::kLaplaceIteration;
  refused.warnings = report.warnings;
  refused.x.resize(problem.num_states(), 0);
  refused.y.resize(problem.num_constraints(), 0);
  refused.w.resize(problem.num_constraints(), 0);
  return refused;
}

absl::StatusOr<Solution> SolveUnlessStopped(const NonlinearProblem& problem, const Options& asked, Observer& observer,
                                            std::stop_token stop) {
  const auto started = std::chrono::steady_clock::now();
  Options options = asked;
  const bool error_by_default = FillInDefaultError(options);
  const bool tries_steps = options.error_tolerance > 0;
  auto functions = NonlinearFunctions::Create(problem);
  if (!functions.ok()) return functions.status();

  const Vector y_guess = FirstGuess(problem, *functions);
  const Matrix g_y = WithoutNoise(functions->GByY(0, problem.x0, y_guess));
  AnalysisReport report;
  Selection selection = Selection::kAny;
  report.matrix_class = "g_y at the start is not finite";
  if (g_y.allFinite()) {
    const MatrixClass matrix_class = Classify(g_y);
    selection = *SelectRule(SolutionRule::kAuto, matrix_class);
    report.matrix_class = "g_y at the start: " + matrix_class.description;
  }
  report.method = Method::kLaplaceIteration;
  report.reason = "(5.1) is solved by the splitting (5.2)";
  report.num_states = problem.num_states();
  report.num_constraints = problem.num_constraints();
  const double steps = CountSteps(problem.horizon, BreakPoints(problem), options);
  const double outputs = options.output_times_only ? static_cast<double>(options.output_times.size()) : steps + 1;
  const double least_bytes = PredictBytes(problem, steps, outputs);
  if (least_bytes > options.max_memory) {
    observer.OnAnalysis(report);
    return Refused(problem, report,
                   "The solve needs about " + FormatNumber(least_bytes) + " bytes, more than " +
                       MemoryLimitText(options) + ". Ask for fewer steps or output times.");
  }
  const Grid grid = MakeGrid(problem.horizon, BreakPoints(problem), options);
  if (!tries_steps) {
    report.num_steps = grid.num_steps();
    report.step = grid.longest_step;
  }
  if (selection == Selection::kAny) {
    report.warnings.push_back(
        "g_y at the start is neither a P-matrix nor a Z-matrix without a zero row: y need not be "
        "a function of x, and any solution is taken; judge by the midpoint residual.");
  }
  for (std::string& warning : SourceWarnings(problem)) report.warnings.push_back(std::move(warning));
  observer.OnAnalysis(report);

  const std::vector<Index> free = functions->ConstraintsAbsentFromG();
  if (selection == Selection::kAny && !free.empty()) {
    return Refused(
        problem, report,
        "y" + std::to_string(free.front() + 1) +
            " occurs in no formula of g, so 0 <= y ⟂ g(t, x, y) >= 0 does not determine it, and the splitting "
            "(5.2) cannot start: only a step that couples x and y could determine it.");
  }
  NonlinearTask task{.problem = problem,
                     .options = options,
                     .selection = selection,
                     .y_guess = y_guess,
                     .workers = Workers(options.num_threads),
                     .stop = std::move(stop),
                     .started = started};
  auto solution = tries_steps ? SolveWithinError(task, error_by_default, observer)
                              : SolveOnGivenSteps(task, *std::move(functions), grid, observer);
  if (!solution.ok()) return solution;
  solution->reason = report.matrix_class + "; " + solution->reason;
  solution->warnings.insert(solution->warnings.begin(), report.warnings.begin(), report.warnings.end());
  return solution;
}

}  // namespace

absl::StatusOr<Solution> SolveNonlinear(const NonlinearProblem& problem, const Options& options, Observer& observer,
                                        std::stop_token stop) {
  if (absl::Status status = CheckValid(problem, options); !status.ok()) return status;
  return SolveNonlinearValidated(problem, options, observer, std::move(stop));
}

absl::StatusOr<Solution> SolveNonlinearValidated(const NonlinearProblem& problem, const Options& options,
                                                 Observer& observer, std::stop_token stop) {
  const StopScope scope(stop);
  try {
    return SolveUnlessStopped(problem, options, observer, stop);
  } catch (const Stopped&) {
    return StoppedBeforeTheStart(problem.num_states(), problem.num_constraints());
  }
}

}  // namespace dlcs
