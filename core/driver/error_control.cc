// SPDX-License-Identifier: Apache-2.0
#include "core/driver/error_control.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "core/discretization/graded_grid.h"
#include "core/discretization/scheme.h"
#include "core/discretization/sources.h"
#include "core/discretization/step_sources.h"
#include "core/driver/memory_prediction.h"
#include "core/driver/source_resolution.h"
#include "core/driver/step_comparison.h"
#include "core/event_driven/event_driven.h"
#include "core/event_driven/mode_sizes.h"
#include "core/event_driven/rounded_data.h"
#include "core/linalg/norms.h"
#include "core/stepping/iterative_step.h"

namespace dlcs {
namespace {

constexpr Index kMaxTrialSteps = Index{1} << 22;
// wu_chen_iteration: its cost grows with the square of the steps, and the contour for the default error costs three
// times that of 25 nodes.
constexpr Index kMaxPaperSteps = 2048;
constexpr Index kMaxDefaultPaperSteps = 256;

bool IsPaper(const Task& task) { return task.plan.method.method == Method::kWuChenIteration; }

// The order of the method for smooth solutions. It is 1 if y is constant on a step or may jump.
double ExpectedOrder(const Task& task) {
  const MethodChoice& method = task.plan.method;
  if (method.two_stages) return 2;
  const bool first_order_steps = method.method == Method::kTimeStepping && !task.options.average_y;
  return !first_order_steps && IsAlwaysLipschitz(task.plan.selection) ? 2 : 1;
}

// Whether a solve on the grid `solved` fits into the allowed memory beside `held` bytes.
bool FitsBeside(const Task& task, const Grid& solved, double held) {
  return held + PredictBytes(task.problem, solved, task.plan.method.method, task.plan.propagator) <=
         task.options.max_memory;
}

double BytesOf(const Solution& solution) {
  return sizeof(double) * static_cast<double>(solution.x.size() + 2 * solution.y.size() + solution.x.cols());
}

// The error of x that comes from a y that is constant on each step. A fast state follows y within a step, so it lags
// behind by the same amount for every step length that is long for it. Comparing two step lengths does not show that.
Vector LagBehind(const Problem& problem, const Solution& solution) {
  Vector lag = Vector::Zero(problem.num_states());
  if (!(solution.step * problem.A.InfinityNorm() > 1)) return lag;
  const Matrix of_change = ExponentialPiecewiseConstant(problem, solution.step).f_before * problem.B.Dense();
  Vector before = Vector::Zero(lag.size());
  for (Index k = 1; k < solution.y.cols(); ++k) {
    const double apart = solution.times[static_cast<std::size_t>(k)] - solution.times[static_cast<std::size_t>(k) - 1];
    const double steps = std::max(1.0, apart / solution.step);  // between output nodes
    const Vector change = (of_change * (solution.y.col(k) - solution.y.col(k - 1)) / steps).cwiseAbs();
    lag = lag.cwiseMax(change.cwiseMin(before));  // a jump of y alone is none
    before = change;
  }
  return lag;
}

// Of what a solve on `grid` sees of the sources of `problem`, which must outlive what is returned.
std::function<Unresolved(const Grid&, const Solution&)> UnresolvedSourcesOf(const Problem& problem) {
  const auto sources = std::make_shared<absl::StatusOr<Sources>>(Sources::Create(problem));
  return [&problem, sources](const Grid& grid, const Solution& solution) {
    if (!sources->ok()) return Unresolved();
    if ((*sources)->FIsSteady(0, problem.horizon) && (*sources)->GIsSteady(0, problem.horizon)) return Unresolved();
    SourceSampler sampler(**sources);
    const Index num_states = problem.num_states(), num_constraints = problem.num_constraints();
    const SourcesAt both_at = [&](double t, Side side, Index) {
      Vector both(num_states + num_constraints);
      sampler.F(t, side, both.head(num_states));
      sampler.G(t, side, both.tail(num_constraints));
      return both;
    };
    Unresolved unresolved{.part = UnresolvedSources(grid, solution, both_at)};
    AddMissedPulses(grid, problem, both_at, unresolved);
    return unresolved;
  };
}

absl::StatusOr<Solution> SolveWithRoundedData(Task& task, const Grid& grid, double ulps) {
  const Problem rounded = WithRoundedData(task.problem, ulps, task.plan.selection == Selection::kUnique);
  Task other{.problem = rounded,
             .options = task.options,
             .plan = task.plan,
             .workers = Workers(task.options.num_threads),
             .stop = task.stop,
             .started = task.started,
             .stages = task.stages};
  Observer silent;
  auto solution = SolveOnGrid(other, grid, silent);
  task.stages = other.stages;
  return solution;
}

Index NodesCompared(const Task& task) { return task.plan.propagator.system ? kFormedNodesKept : kNodesKept; }

// `task` must outlive what is returned.
SystemSolves SolvesOf(Task& task, Observer& observer) {
  const bool y_counts = IsAlwaysLipschitz(task.plan.selection);
  const bool impacts = task.plan.method.inelastic_impact;
  const bool lags =
      task.plan.method.method == Method::kExponentialIntegrator && !y_counts && !task.plan.propagator.system;
  SystemSolves system{
      .horizon = task.problem.horizon,
      .break_points = BreakPoints(task.problem),
      .expected_order = ExpectedOrder(task),
      .event_driven_serves = !impacts && !task.follows_event_driven,
      .nodes_compared = NodesCompared(task),
      .trials = {
          .solve = [&task, &observer](const Grid& grid) { return SolveOnGrid(task, grid, observer); },
          .sizes = [&task, y_counts](const Solution& solution) { return SizesOf(task.problem, solution, y_counts); },
          .rounding_of_terms = [&task](const ComponentValues& sizes) { return RoundingOfTerms(task.problem, sizes); },
          .compare =
              [&task, impacts, lags](const Solution& coarse, const Solution& fine, const ComponentValues& sizes) {
                ComponentValues differences = DifferencesBetween(coarse, fine, sizes, impacts ? coarse.step : 0);
                if (lags && coarse.step != fine.step) differences.x += LagBehind(task.problem, fine);
                return differences;
              },
          .follow_states =
              [&task](const Solution& solution, TrajectoryErrors& errors) {
                AddEffectOfSlacks(task.problem, solution, errors);
                RaiseToEffectOfStates(task.problem, solution, errors);
              },
          .unresolved = UnresolvedSourcesOf(task.problem),
          .fits = {}}};
  // In a sparse A a state forgets in less time than its diagonal entry says, so this would be far too large.
  if (task.problem.A.is_dense()) {
    system.trials.at_switches = [&task](const Solution& solution, const ComponentValues& sizes) {
      return SwitchChanges(solution, task.problem, sizes);
    };
  }
  // Other forms of A have set-ups of their own, too dear for this.
  if (!task.plan.propagator.system) {
    system.trials.solve_rounded = [&task](const Grid& grid, double ulps) {
      return SolveWithRoundedData(task, grid, ulps);
    };
  }
  return system;
}

// Adds what the contours of wu_chen_iteration are off by, which is alike on all grids: how far `solution` is from the
// one of the same iteration on the same grid that integrates the same interpolants by φ-functions. Unlike a bound it
// holds for every spectrum and source, and contains what the system makes of the error from iterate to iterate.
absl::Status CountContours(Task& task, const Grid& grid, Solution& solution) {
  if (!solution.contour || solution.contour->nodes == 0) return absl::OkStatus();
  Observer silent;
  task.plan.method.without_contours = true;
  const absl::StatusOr<Solution> other = SolveOnGrid(task, grid, silent);
  task.plan.method.without_contours = false;
  if (!other.ok()) return other.status();
  TrajectoryErrors& errors = solution.accuracy.errors;
  if (other->termination != Termination::kReachedEnd) {
    RaiseTruncation(1, errors);
    solution.accuracy.note += " Nothing is known of the error of the contours: without them the solve ended as " +
                              std::string(TerminationName(other->termination)) + ". " + other->message;
    return absl::OkStatus();
  }
  const ComponentValues sizes = SizesOf(task.problem, solution, errors.y.own.size() > 0);
  const ComponentValues rounding{errors.x.rounding, errors.y.rounding, errors.w.rounding};
  const TrajectoryErrors of_contours =
      ErrorsOf(sizes, Beyond(DifferencesBetween(solution, *other, sizes), rounding), rounding);
  for (const ComponentKind kind : kComponentKinds) {
    if (errors.of(kind).own.size() > 0) errors.of(kind).truncation += of_contours.of(kind).truncation;
  }
  return absl::OkStatus();
}

// Whether steps must resolve the fast decay after a start far from rest and after jumps of the sources: those for a
// large sparse A. Matrix functions of A are exact there.
bool ResolvesLayers(const Plan& plan) {
  return plan.method.method == Method::kTimeStepping &&
         (plan.propagator.record.used == PropagatorKind::kSparseStepping ||
          plan.propagator.record.used == PropagatorKind::kIterativeStepping);
}

Grid GradedForLayers(const Problem& problem, const Grid& grid) {
  absl::StatusOr<Sources> sources = Sources::Create(problem);
  if (!sources.ok()) return grid;
  return GradeBehind(grid, LayerTimes(problem, *sources), FastestStep(problem), 2 * grid.num_steps());
}

void Judge(const Task& task, Solution& solution) {
  JudgeBesideModes(task.problem, task.plan.selection, task.options, solution);
}

// Steps as short as options.error_tolerance requires; the nodes of a given grid are output times only.
absl::StatusOr<Solution> SolveWithinError(Task& task, Observer& observer) {
  if (IsPaper(task)) {
    // No halving of steps shows the error of the contour, e^{-2.06 √P}: it gets a thirtieth of the tolerance.
    const double root = std::log(30 / task.options.error_tolerance) / 2.06;
    task.options.num_contour_nodes =
        std::max(task.options.num_contour_nodes, static_cast<Index>(std::ceil(root * root)));
  }
  TrialObserver windows(observer, task.problem.horizon);
  SystemSolves system = SolvesOf(task, windows);
  system.trials.solve = [&](const Grid& grid) {
    windows.NextTrial();
    return SolveOnGrid(task, grid, windows);
  };
  system.trials.fits = [&task](const Grid& grid) {
    const Grid next = Halve(grid);
    const double held = sizeof(double) * static_cast<double>(grid.output_nodes.size()) *
                        static_cast<double>(1 + task.problem.num_states() + 2 * task.problem.num_constraints());
    return FitsBeside(task, next, held);
  };
  if (ResolvesLayers(task.plan)) {
    system.grade = [&task](const Grid& grid) { return GradedForLayers(task.problem, grid); };
  }
  system.most_default_steps = Options::MaxDefaultSteps(system.break_points.size());
  if (task.follows_event_driven) system.most_default_steps -= kMaxDefaultEventWork;
  const Index most_of_paper = task.error_by_default ? kMaxDefaultPaperSteps : kMaxPaperSteps;
  const Index most_steps = IsPaper(task) ? most_of_paper : kMaxTrialSteps;
  std::vector<double> wanted;
  auto result = TrySteps(system, task.options, most_steps, task.error_by_default, wanted);
  if (!result.ok()) return result.status();
  Solution& solution = result->solution;
  if (solution.termination == Termination::kReachedEnd) {
    if (absl::Status status = CountContours(task, result->grid, solution); !status.ok()) return status;
  }
  ConcludeTrials(system, *result, task.options, task.error_by_default, solution);
  Judge(task, solution);
  if (task.options.output_times_only || task.options.has_grid()) KeepTimes(wanted, solution);
  return std::move(solution);
}

}  // namespace

bool FillInDefaultError(Options& options) {
  if (options.has_grid() || options.error_tolerance > 0) return false;
  options.error_tolerance = Options::kDefaultErrorTolerance;
  return true;
}

double TrialObserver::Overall(double time) const {
  return horizon_ * (1 - std::exp2(1 - trial_) * (1 - time / (2 * horizon_)));
}

void TrialObserver::OnWindowStarted(const WindowReport& window) {
  WindowReport report = window;
  report.begin = Overall(window.begin);
  report.end = Overall(window.end);
  observer_.OnWindowStarted(report);
}

void TrialObserver::OnWindowFinished(const WindowOutcome& outcome) {
  WindowOutcome report = outcome;
  report.end = Overall(outcome.end);
  observer_.OnWindowFinished(report);
}

absl::StatusOr<Solution> SolveAsAsked(Task& task, Observer& observer) {
  const bool controls_its_steps = task.plan.method.method == Method::kEventDriven;
  if (task.options.error_tolerance > 0 && !controls_its_steps) return SolveWithinError(task, observer);
  return SolveOnGrid(task, task.plan.grid, observer, task.resume);
}

absl::Status EstimateError(Task& task, Solution& solution) {
  if (solution.termination != Termination::kReachedEnd || solution.accuracy.source != AccuracySource::kNotEstimated)
    return absl::OkStatus();
  if (!task.options.estimate_error) {
    solution.accuracy.note = "No estimate was requested.";
    return absl::OkStatus();
  }
  const Grid& grid = task.plan.grid;
  if (!FitsBeside(task, WithOtherSteps(grid, 2, NodesCompared(task)),
                  BytesOf(solution) + sizeof(double) * 2.0 * grid.times.size())) {
    solution.accuracy.note =
        "No estimate: a second solve does not fit into the memory allowed (--max-memory) together with the trajectory.";
    return absl::OkStatus();
  }
  if (task.stop.stop_requested()) {
    solution.accuracy.note = "No estimate: stopped on request.";
    return absl::OkStatus();
  }
  Observer silent;
  const bool left_checkpoints = std::exchange(task.leaves_checkpoints, false);
  absl::Status status = CompareSteps(SolvesOf(task, silent), grid, solution);
  if (status.ok() && solution.accuracy.source != AccuracySource::kNotEstimated) {
    status = CountContours(task, grid, solution);
  }
  task.leaves_checkpoints = left_checkpoints;
  if (solution.propagator.used == PropagatorKind::kIterativeStepping) {
    const Index steps = grid.num_steps();
    const double in_sum = static_cast<double>(steps) * IterativeStep::ToleranceFor(task.options, steps);
    for (const ComponentKind kind : kComponentKinds) {
      ErrorsByCause& errors = solution.accuracy.errors.of(kind);
      errors.truncation += in_sum * errors.own;
    }
  }
  if (solution.accuracy.source != AccuracySource::kNotEstimated) Judge(task, solution);
  // The times of all solves count.
  Cost& cost = solution.cost;
  cost.seconds_setup = cost.seconds_lcp = cost.seconds_linear = cost.seconds_certificate = 0;
  cost.AddStages(task.stages);
  cost.seconds_total = SecondsSince(task.started);
  return status;
}

}  // namespace dlcs
