// SPDX-License-Identifier: Apache-2.0

#include "core/nonlinear/solve_nonlinear.h"

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "core/analysis/matrix_class.h"
#include "core/linalg/norms.h"
#include "core/methods/solve_context.h"
#include "core/methods/step_control.h"
#include "core/nonlinear/splitting_iteration.h"
#include "core/parallel/stop_scope.h"
#include "core/report.h"

namespace dlcs {
namespace {

// What stays the same when the step is halved.
struct Task {
  const NonlinearProblem& problem;
  const Options& options;
  Selection selection;
  Vector y_guess;
  Workers workers;
  std::stop_token stop;
  std::chrono::steady_clock::time_point started;
};

// Where g has a value at time 0: y = 0, unless a formula like log(y1) forbids it.
Vector FirstGuess(const NonlinearProblem& problem, NonlinearFunctions& functions) {
  const Vector zero = Vector::Zero(problem.num_constraints());
  return functions.G(0, problem.x0, zero).allFinite() ? zero : Vector::Ones(problem.num_constraints()).eval();
}

// g_y with what may be rounding of its differences taken for zero, so that its class can be told.
Matrix WithoutNoise(Matrix jacobian) {
  const double noise = 1e-9 * MaxAbs(jacobian);
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

Solution SolveOnGrid(Task& task, NonlinearFunctions functions, const Grid& grid, Observer& observer) {
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
    solution.message = "Reached T = " + FormatNumber(task.problem.horizon) + " in " +
                       std::to_string(solution.cost.steps) + " steps.";
  }
  context.recorder.Finish();
  solution.cost.seconds_total = context.Seconds();
  return solution;
}

// The splitting is of second order: the error is 4/3 of the difference to half the step.
void EstimateError(Task& task, NonlinearFunctions functions, const Grid& grid, Solution& solution) {
  Observer silent;
  const Solution finer = SolveOnGrid(task, std::move(functions), Halve(grid), silent);
  solution.cost.seconds_total = finer.cost.seconds_total;  // both count from the same start
  if (finer.termination != Termination::kReachedEnd) {
    solution.accuracy.note = std::string("Not estimated: with half the step the solve ended as ") +
                             TerminationName(finer.termination) + ". " + finer.message;
    return;
  }
  solution.accuracy.source = AccuracySource::kCompared;
  solution.accuracy.error = NanMax(4.0 / 3 * RelativeDifference(solution.x, finer.x), Accuracy::kLeastError);
}

absl::StatusOr<Solution> SolveUnlessStopped(const NonlinearProblem& problem, const Options& options, Observer& observer,
                                            std::stop_token stop) {
  const auto started = std::chrono::steady_clock::now();
  if (absl::Status status = CheckSound(problem, options); !status.ok()) return status;
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
  const Grid grid = MakeGrid(problem.horizon, BreakPoints(problem), options);
  report.method = Method::kLaplaceIteration;
  report.reason = "(5.1) is solved by the splitting (5.2)";
  report.num_states = problem.num_states();
  report.num_constraints = problem.num_constraints();
  report.num_steps = grid.num_steps();
  report.step = grid.longest_step;
  if (options.num_steps == 0 && options.step == 0 && options.grid_times.empty()) {
    report.warnings.push_back("No step was given; taking " + std::to_string(Options::kDefaultSteps) + " steps.");
  }
  if (selection == Selection::kAny) {
    report.warnings.push_back("g_y at the start is neither a P-matrix nor a Z-matrix without a zero row: y need not be "
                              "a function of x, and any solution is taken; judge by the midpoint residual.");
  }
  for (std::string& warning : SourceWarnings(problem)) report.warnings.push_back(std::move(warning));
  observer.OnAnalysis(report);

  const std::vector<Index> free = functions->ConstraintsAbsentFromG();
  if (selection == Selection::kAny && !free.empty()) {
    Solution refused;
    refused.termination = Termination::kUnsupported;
    refused.message =
        "y" + std::to_string(free.front() + 1) +
        " occurs in no formula of g, so 0 <= y ⟂ g(t, x, y) >= 0 does not determine it, and the splitting "
        "(5.2) cannot start: only a step that couples x and y means anything here.";
    refused.failure_time = 0;
    refused.method = Method::kLaplaceIteration;
    refused.warnings = report.warnings;
    refused.x.resize(problem.num_states(), 0);
    refused.y.resize(problem.num_constraints(), 0);
    refused.w.resize(problem.num_constraints(), 0);
    return refused;
  }
  Task task{.problem = problem,
            .options = options,
            .selection = selection,
            .y_guess = y_guess,
            .workers = Workers(options.num_threads),
            .stop = std::move(stop),
            .started = started};
  Solution solution = SolveOnGrid(task, *std::move(functions), grid, observer);
  solution.reason = report.matrix_class + "; " + solution.reason;
  solution.warnings = report.warnings;
  if (options.estimate_error && solution.termination == Termination::kReachedEnd) {
    auto again = NonlinearFunctions::Create(problem);
    if (!again.ok()) return again.status();
    EstimateError(task, *std::move(again), grid, solution);
  }
  return solution;
}

}  // namespace

absl::StatusOr<Solution> SolveNonlinear(const NonlinearProblem& problem, const Options& options, Observer& observer,
                                        std::stop_token stop) {
  const StopScope scope(stop);
  try {
    return SolveUnlessStopped(problem, options, observer, stop);
  } catch (const Stopped&) {
    return StoppedBeforeTheStart(problem.num_states(), problem.num_constraints());
  }
}

}  // namespace dlcs
