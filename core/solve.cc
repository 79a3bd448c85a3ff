// SPDX-License-Identifier: Apache-2.0

#include "core/solve.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "core/analysis/lipschitz.h"
#include "core/analysis/matrix_class.h"
#include "core/linalg/norms.h"
#include "core/methods/event_located.h"
#include "core/methods/exponential_march.h"
#include "core/methods/grid.h"
#include "core/methods/inelastic_impact.h"
#include "core/methods/laplace_iteration.h"
#include "core/methods/method_choice.h"
#include "core/methods/paper_iteration.h"
#include "core/methods/shared_setup.h"
#include "core/methods/solve_context.h"
#include "core/methods/step_control.h"
#include "core/methods/time_stepping.h"
#include "core/parallel/parallel.h"
#include "core/realisation/choice.h"
#include "core/realisation/memory_prediction.h"
#include "core/soundness.h"

namespace dlcs {
namespace {

// What stays the same when the step is halved.
struct Task {
  const Problem& problem;
  Options options;
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
      return EventLocated(context);
    case Method::kExponentialMarch:
    case Method::kAuto:
      break;
  }
  return ExponentialMarch(context);
}

// y beyond the class that M promises: the coupled step has another matrix than M.
void WarnOfCoupledClass(const Task& task, double step, std::vector<std::string>& warnings) {
  if (task.choice.method != Method::kTimeStepping || !IsAlwaysLipschitz(task.selection)) return;
  if (!task.choice.refusal.empty()) return;
  if (task.options.step_solver == StepSolver::kNewton) return;  // its LCPs are those of M
  if (task.problem.num_constraints() > 20) return;
  const Matrix coupled = CoupledStepMatrix(task.problem, task.options, step);
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
  solution.step = grid.longest_step;  // of event_located its own
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
  if (solution.termination != Termination::kConverged) return;
  Certificate& certificate = solution.certificate;
  certificate.estimated_error_x = result.error * certificate.x_scale;
  if (IsAlwaysLipschitz(task.selection)) {
    certificate.estimated_error_By = result.error * MaxAbs(task.problem.B * solution.y);
  }
  const std::string seen = std::to_string(solution.cost.steps) + " steps, whose error is estimated as " +
                           FormatNumber(result.error) + " of the size of x (order seen " +
                           FormatNumber(std::round(10 * result.order) / 10) + ")";
  if (result.reached) {
    solution.message = "Solved on [0, " + FormatNumber(task.problem.horizon) + "] in " + seen + ".";
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

  const bool is_paper = task.choice.method == Method::kPaperIteration;
  if (is_paper) {
    // No halving of steps shows the error of the contour, e^{-2.06 √P}: it gets a thirtieth of the tolerance.
    const double root = std::log(30 / options.error_tolerance) / 2.06;
    task.options.num_contour_nodes = std::max(options.num_contour_nodes, static_cast<Index>(std::ceil(root * root)));
  }
  const StepControl control{.tolerance = options.error_tolerance,
                            .y_counts = IsAlwaysLipschitz(task.selection),
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

absl::StatusOr<Solution> SolveTask(Task& task, const Grid& grid, Observer& observer) {
  const bool controls_its_steps = task.choice.method == Method::kEventLocated || task.choice.inelastic_impact;
  if (task.options.error_tolerance == 0 || controls_its_steps) return SolveOnGrid(task, grid, observer);
  return SolveWithinError(task, observer);
}

// Compares `solution` with the same solve on half the step: for a method of order p the error is the difference times
// 2^p / (2^p - 1). event_located is compared with a hundredth of its tolerance.
absl::Status EstimateError(Task& task, const Grid& grid, Solution& solution) {
  Observer silent;
  const bool located = task.choice.method == Method::kEventLocated;
  const double asked = task.options.error_tolerance;
  if (located) {
    const double tolerance = asked > 0 ? asked : kDefaultEventTolerance;
    task.options.error_tolerance = std::max(tolerance / 100, Options::kLeastErrorTolerance);
  }
  const auto finer = SolveOnGrid(task, Halve(grid), silent);
  task.options.error_tolerance = asked;
  if (!finer.ok()) return finer.status();
  solution.cost.seconds_total = finer->cost.seconds_total;  // both count from the same start
  if (finer->termination != Termination::kConverged) {
    solution.warnings.push_back("No error estimate: with " +
                                std::string(located ? "a hundredth of the error" : "half the step") +
                                " the solve ended as " + TerminationName(finer->termination) + ". " + finer->message);
    return absl::OkStatus();
  }
  const bool first_order_steps = task.choice.method == Method::kTimeStepping && !task.options.average_y;
  const bool second_order = !first_order_steps && IsAlwaysLipschitz(task.selection);
  const double factor = located ? 1 : second_order ? 4.0 / 3 : 2.0;
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
    const bool any_realisation =
        options.realisation == Realisation::kAuto || options.realisation == Realisation::kSparseStepping;
    if (!task.realisation.refusal.empty() && options.method == Method::kAuto && any_realisation) {
      task.choice.method = Method::kTimeStepping;
      task.choice.reason = "the matrix exponential is out of reach: " + task.realisation.refusal;
      task.realisation = ChooseRealisation(problem, options, task.choice.method);
    }
    task.choice.refusal = task.realisation.refusal;
  }
  const Grid grid = MakeGrid(problem.horizon, BreakPoints(problem), options);
  const double predicted_bytes = PredictBytes(problem, grid, task.choice.method, task.realisation.record.used);
  const bool is_served = task.choice.refusal.empty();
  if (is_served && predicted_bytes > options.max_memory) {
    task.choice.refusal = "The solve needs about " + FormatNumber(predicted_bytes) + " bytes, more than max_memory = " +
                          FormatNumber(options.max_memory) +
                          ". Ask for fewer output times, or for a realisation that needs less.";
  }
  AnalysisReport report;
  report.matrix_class = matrix_class.description;
  report.method = task.choice.method;
  report.reason = task.choice.reason;
  report.num_states = problem.num_states();
  report.num_constraints = problem.num_constraints();
  const bool controls_steps = options.error_tolerance > 0 || task.choice.method == Method::kEventLocated;
  if (!controls_steps) {
    report.num_steps = grid.num_steps();
    report.step = grid.longest_step;
  }
  report.lipschitz = task.matrix_class.lipschitz;
  if (!options.has_grid() && !controls_steps) {
    report.warnings.push_back("No step was given; taking " + std::to_string(Options::kDefaultSteps) + " steps.");
  }
  if (!controls_steps) WarnOfCoupledClass(task, grid.longest_step, report.warnings);
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
    if (is_served) refused.cost.predicted_bytes = predicted_bytes;  // too much; otherwise of no form that would serve
    refused.x.resize(problem.num_states(), 0);
    refused.y.resize(problem.num_constraints(), 0);
    return refused;
  }
  auto solution = SolveTask(task, grid, observer);
  if (!solution.ok()) return solution;
  // Another method or selection after `why`.
  const auto solve_again = [&](const Options& choose_by, const std::string& why) {
    report.warnings.push_back(why);
    task.choice = ChooseMethod(problem, choose_by, matrix_class, task.selection);
    task.realisation = ChooseRealisation(problem, options, task.choice.method);
    report.method = task.choice.method;
    report.reason = task.choice.reason;
    observer.OnAnalysis(report);
    solution = SolveTask(task, grid, observer);
    return solution.ok();
  };
  const bool needs_function =
      options.method == Method::kLaplaceIteration || options.method == Method::kPaperIteration ||
      (options.method == Method::kTimeStepping && (options.average_y || options.step_solver == StepSolver::kNewton));
  const bool may_couple = problem.rule == SolutionRule::kAuto && !needs_function;
  if (task.lost_least_element && may_couple) {
    task.selection = Selection::kAny;
    if (!solve_again(options, solution->message + " Solved again by coupled steps, any solution of theirs.")) {
      return solution;
    }
  }
  const bool missed_by_events = options.method == Method::kAuto && task.choice.method == Method::kEventLocated &&
                                solution->termination == Termination::kIterationLimit;
  if (missed_by_events) {
    Options without_events = options;
    without_events.error_tolerance = 0;
    Solution located = *std::move(solution);
    if (!solve_again(without_events, located.message + " Solved again by steps without events.")) return solution;
    const bool better = solution->termination == Termination::kConverged;
    if (!better) solution = std::move(located);
  }
  if (controls_steps && solution->termination == Termination::kConverged) {
    WarnOfCoupledClass(task, solution->step, solution->warnings);
  }
  solution->cost.predicted_bytes = predicted_bytes;
  solution->warnings.insert(solution->warnings.begin(), report.warnings.begin(), report.warnings.end());
  const bool has_estimate = solution->certificate.estimated_error_x.has_value() &&
                            solution->method != Method::kEventLocated;
  if (options.estimate_error && !has_estimate && solution->termination == Termination::kConverged) {
    if (absl::Status status = EstimateError(task, grid, *solution); !status.ok()) return status;
  }
  return solution;
}

}  // namespace dlcs
