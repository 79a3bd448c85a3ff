// SPDX-License-Identifier: Apache-2.0

#include "core/solve.h"

#include <chrono>
#include <optional>
#include <utility>

#include "core/analysis/lipschitz.h"
#include "core/analysis/matrix_class.h"
#include "core/linalg/norms.h"
#include "core/methods/exponential_march.h"
#include "core/methods/grid.h"
#include "core/methods/inelastic_impact.h"
#include "core/methods/laplace_iteration.h"
#include "core/methods/method_choice.h"
#include "core/methods/paper_iteration.h"
#include "core/methods/shared_setup.h"
#include "core/methods/solve_context.h"
#include "core/methods/time_stepping.h"
#include "core/parallel/parallel.h"
#include "core/realisation/choice.h"
#include "core/soundness.h"

namespace dlcs {
namespace {

// What stays the same when the step is halved.
struct Task {
  const Problem& problem;
  const Options& options;
  MatrixClass matrix_class;
  Selection selection;
  MethodChoice choice;
  Workers workers;
  std::stop_token stop;
  std::chrono::steady_clock::time_point started;
  SetupCache* setups = nullptr;  // may be null
  std::optional<double> largest_slope = std::nullopt;  // see SolveContext
  RealisationChoice realisation = {};
  bool lost_least_element = false;      // by the last pass
};

bool RunMethod(const MethodChoice& choice, SolveContext& context) {
  if (choice.inelastic_impact) return InelasticImpact(context);
  switch (choice.method) {
    case Method::kLaplaceIteration:
      return LaplaceIteration(context);
    case Method::kPaperIteration:
      return PaperIteration(context);
    case Method::kTimeStepping:
      return TimeStepping(context);
    case Method::kEventLocated:
    case Method::kExponentialMarch:
    case Method::kAuto:
      break;
  }
  return ExponentialMarch(context);
}

// y beyond the class that M promises: the coupled step has another matrix than M.
void WarnOfCoupledClass(const Task& task, double step, std::vector<std::string>& warnings) {
  if (task.choice.method != Method::kTimeStepping || !IsAlwaysLipschitz(task.selection)) return;
  if (task.options.step_solver == StepSolver::kNewton) return;  // its LCPs are those of M
  if (task.problem.num_constraints() > 20) return;
  const Scheme scheme = TimeSteppingScheme(task.problem, task.options, step);
  const Matrix coupled = task.problem.M.Dense() + task.problem.N * scheme.y_after;
  if (!coupled.allFinite()) return;
  const MatrixClass of_coupled = Classify(coupled);
  if (task.selection == Selection::kHiddenLeastElement) return;
  const Fact& fact = task.selection == Selection::kUnique ? of_coupled.p : of_coupled.z;
  if (fact.answer != Answer::kNo) return;
  warnings.push_back(std::string("M is a ") + (task.selection == Selection::kUnique ? "P" : "Z") +
                     "-matrix, but M^h = " +
                     (task.options.average_y ? "h/2 N (I - hA/2)⁻¹ B" : "h N (I - h(1-θ)A)⁻¹ B") +
                     " + M of the step h = " + FormatNumber(step) +
                     " is not (" + fact.why + "): a step may have no solution or another one; take a smaller step.");
}

// One pass over one grid.
absl::StatusOr<Solution> SolveOnGrid(Task& task, const Grid& grid, Observer& observer) {
  auto sources = Sources::Create(task.problem);
  if (!sources.ok()) return sources.status();
  Solution solution;
  solution.method = task.choice.method;
  solution.reason = task.choice.reason;
  solution.step = grid.longest_step;
  solution.realisation = task.realisation.record;
  SolveContext context{.problem = task.problem,
                       .options = task.options,
                       .matrix_class = task.matrix_class,
                       .selection = task.selection,
                       .grid = grid,
                       .sources = *std::move(sources),
                       .workers = task.workers,
                       .observer = observer,
                       .stop = task.stop,
                       .recorder = Recorder(grid, task.problem.num_states(), task.problem.num_constraints(), solution),
                       .certificate = CertificateBuilder(task.problem),
                       .solution = solution,
                       .started = task.started,
                       .realised = task.realisation.system.get(),
                       .setups = task.setups,
                       .largest_slope = task.largest_slope,
                       .impulsive_rows = task.choice.impulsive_rows};
  solution.cost.seconds_setup = context.Seconds();
  if (RunMethod(task.choice, context)) {
    solution.termination = Termination::kConverged;
    solution.message = "Solved on [0, " + FormatNumber(task.problem.horizon) + "] in " +
                       std::to_string(solution.cost.steps) + " steps.";
  }
  if (context.first_impulse) {
    solution.warnings.push_back(
        "y > 0 at t = " + FormatNumber(*context.first_impulse) + " in " + task.choice.impulsive +
        ", which only impulses can keep: y grows there as the step shrinks, and what x does "
        "belongs to the method and not to the system.");
  }
  task.lost_least_element = context.lost_least_element;
  context.recorder.Finish();
  solution.certificate = context.certificate.certificate();
  const bool finite = solution.x.allFinite() && solution.y.allFinite();
  if (!finite && solution.termination == Termination::kConverged) {
    context.Fail(Termination::kNonFinite, task.problem.horizon, "The trajectory holds a number that is not finite.");
  }
  solution.cost.seconds_total = context.Seconds();
  return solution;
}

// Compares `solution` with the same solve on half the step: for a method of order p the error is the difference times
// 2^p / (2^p - 1).
absl::Status EstimateError(Task& task, const Grid& grid, Solution& solution) {
  Observer silent;
  const auto finer = SolveOnGrid(task, Halve(grid), silent);
  if (!finer.ok()) return finer.status();
  solution.cost.seconds_total = finer->cost.seconds_total;  // both count from the same start
  if (finer->termination != Termination::kConverged) {
    solution.warnings.push_back("No error estimate: with half the step the solve ended as " +
                                std::string(TerminationName(finer->termination)) + ". " + finer->message);
    return absl::OkStatus();
  }
  const bool first_order_steps = task.choice.method == Method::kTimeStepping && !task.options.average_y;
  const bool second_order = !first_order_steps && IsAlwaysLipschitz(task.selection);
  const double factor = second_order ? 4.0 / 3 : 2.0;
  solution.certificate.estimated_error_x = factor * MaxAbs(solution.x - finer->x);
  solution.certificate.estimated_error_By = factor * MaxAbs(task.problem.B * (solution.y - finer->y));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Solution> Solve(const Problem& problem, const Options& options, Observer& observer,
                               std::stop_token stop, SetupCache* setups) {
  const auto started = std::chrono::steady_clock::now();
  if (absl::Status status = CheckSound(problem, options); !status.ok()) return status;

  const MatrixClass matrix_class = SharedClass(problem, setups);
  const auto selection = SelectRule(problem.rule, matrix_class);
  if (!selection.ok()) return selection.status();
  Task task{.problem = problem,
            .options = options,
            .matrix_class = matrix_class,
            .selection = *selection,
            .choice = ChooseMethod(problem, options, matrix_class, *selection),
            .workers = Workers(options.num_threads),
            .stop = std::move(stop),
            .started = started,
            .setups = setups};

  const bool iterates =
      task.choice.method == Method::kLaplaceIteration || task.choice.method == Method::kPaperIteration;
  if (iterates && !IsAlwaysLipschitz(*selection) && task.choice.refusal.empty()) {
    // Where the iterates do not jump it is their Lipschitz constant.
    task.largest_slope = task.matrix_class.lipschitz = LargestSlope(problem.M);
  }
  if (task.choice.refusal.empty()) {
    task.realisation = ChooseRealisation(problem, options, task.choice.method);
    task.choice.refusal = task.realisation.refusal;
  }
  const Grid grid = MakeGrid(problem.horizon, BreakPoints(problem), options);
  AnalysisReport report;
  report.matrix_class = matrix_class.description;
  report.method = task.choice.method;
  report.reason = task.choice.reason;
  report.num_states = problem.num_states();
  report.num_constraints = problem.num_constraints();
  report.num_steps = grid.num_steps();
  report.step = grid.longest_step;
  report.lipschitz = task.matrix_class.lipschitz;
  if (options.num_steps == 0 && options.step == 0 && options.grid_times.empty()) {
    report.warnings.push_back("No step was given; taking " + std::to_string(Options::kDefaultSteps) + " steps.");
  }
  WarnOfCoupledClass(task, grid.longest_step, report.warnings);
  if (task.choice.inelastic_impact) {
    report.warnings.push_back(
        "Solved as inelastic impact: where a constraint with N x + g = 0 would be violated, the state jumps so that "
        "(N x + g)' = 0. This law was asked for; the system itself does not hold it.");
  }
  if (!task.choice.impulsive_rows.empty()) {
    report.warnings.push_back(
        "y reaches " + task.choice.impulsive +
        " through two or more integrations only: should it become active, solutions need impulses.");
  }
  observer.OnAnalysis(report);

  if (!task.choice.refusal.empty()) {
    Solution refused;
    refused.termination = Termination::kUnsupported;
    refused.message = task.choice.refusal;
    refused.failure_time = 0;
    refused.method = task.choice.method;
    refused.reason = task.choice.reason;
    refused.warnings = report.warnings;
    refused.x.resize(problem.num_states(), 0);
    refused.y.resize(problem.num_constraints(), 0);
    return refused;
  }
  auto solution = SolveOnGrid(task, grid, observer);
  if (!solution.ok()) return solution;
  const bool needs_function =
      options.method == Method::kLaplaceIteration || options.method == Method::kPaperIteration ||
      (options.method == Method::kTimeStepping && (options.average_y || options.step_solver == StepSolver::kNewton));
  const bool may_couple = problem.rule == SolutionRule::kAuto && !needs_function;
  if (task.lost_least_element && may_couple) {
    report.warnings.push_back(solution->message + " Solved again by coupled steps, any solution of theirs.");
    task.selection = Selection::kAny;
    task.choice = ChooseMethod(problem, options, matrix_class, task.selection);
    report.method = task.choice.method;
    report.reason = task.choice.reason;
    observer.OnAnalysis(report);
    solution = SolveOnGrid(task, grid, observer);
    if (!solution.ok()) return solution;
  }
  solution->warnings.insert(solution->warnings.begin(), report.warnings.begin(), report.warnings.end());
  if (options.estimate_error && solution->termination == Termination::kConverged) {
    if (absl::Status status = EstimateError(task, grid, *solution); !status.ok()) return status;
  }
  return solution;
}

}  // namespace dlcs
