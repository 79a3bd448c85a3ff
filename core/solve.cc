// SPDX-License-Identifier: Apache-2.0
#include "core/solve.h"

#include <chrono>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "core/driver/error_control.h"
#include "core/driver/fallback.h"
#include "core/driver/grid_solve.h"
#include "core/driver/plan.h"
#include "core/driver/propagator_choice.h"
#include "core/driver/report.h"
#include "core/outputs/measure_outputs.h"
#include "core/parallel/stop_scope.h"
#include "core/parallel/team.h"
#include "core/periodic/periodic.h"
#include "core/problem/condition_pairs.h"
#include "core/problem/number_range.h"
#include "core/problem/source_periods.h"
#include "core/problem/validate.h"
#include "core/problem/verdict.h"
#include "core/problem/violation_list.h"
#include "core/setup_cache.h"

namespace dlcs {

namespace {

// The processes of a team may have read files that differ. Compares matrices, x0 and T.
absl::Status CheckSameInTeam(const Problem& problem) {
  Team& team = Team::Current();
  if (team.is_alone()) return absl::OkStatus();
  const auto differs = [&](const SetupKey& key) { return !team.IsSame(std::hash<std::string>()(key.bytes())); };
  const std::pair<const char*, const StructuredMatrix*> matrices[] = {
      {"A", &problem.A}, {"B", &problem.B}, {"N", &problem.N}, {"M", &problem.M}, {"E", &problem.E}};
  std::string differing;
  for (const auto& [name, matrix] : matrices) {
    if (differs(SetupKey(name).Add(*matrix)) && differing.empty()) differing = name;
  }
  if (differs(SetupKey("x0").Add(Matrix(problem.x0)).Add(problem.horizon)) && differing.empty()) differing = "x0 or T";
  if (differing.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError("the processes of this solve have read different problems: " + differing +
                                       " is not the same in all of them");
}

absl::StatusOr<Solution> SolveUnlessStopped(const Problem& problem, const Options& asked, Observer& observer,
                                            std::stop_token stop, SetupCache* setups, const ResumePoint* resume) {
  const auto started = std::chrono::steady_clock::now();
  Options options = asked;
  // If the options name event_driven, it has its own error control.
  const bool error_by_default = options.method != Method::kEventDriven && FillInDefaultError(options);
  auto plan = MakePlan(problem, options, setups);
  if (!plan.ok()) return plan.status();
  AnalysisReport report = ReportOn(problem, options, *plan);
  observer.OnAnalysis(report);
  if (plan->is_refused()) return Refusal(problem, *plan, report);

  const bool finds_steps = plan->finds_steps(options);
  Task task{.problem = problem,
            .options = options,
            .plan = *std::move(plan),
            .workers = Workers(options.num_threads),
            .stop = std::move(stop),
            .started = started,
            .setups = setups,
            .resume = resume,
            .error_by_default = error_by_default};
  task.leaves_checkpoints = !MayFallBack(task);
  auto solution = SolveAsAsked(task, observer);
  if (solution.ok()) solution = FallBack(task, report, observer, *std::move(solution));
  if (!solution.ok()) return solution;

  solution->cost.predicted_bytes = task.plan.predicted_bytes;
  if (finds_steps && solution->termination == Termination::kReachedEnd) {
    WarnOfCoupledClass(problem, options, task.plan, solution->step, solution->warnings);
  }
  solution->warnings.insert(solution->warnings.begin(), report.warnings.begin(), report.warnings.end());
  if (absl::Status status = EstimateError(task, *solution); !status.ok()) return status;
  return solution;
}

// A mass matrix that is not diagonal is only known to be too small once it was multiplied out.
absl::Status CheckMultiplied(const Problem& problem, const Problem& solved) {
  if (!problem.has_mass() || solved.has_mass() || (solved.A.AllFinite() && solved.B.AllFinite())) {
    return absl::OkStatus();
  }
  return InvalidField("E", std::string("too small beside ") + (solved.A.AllFinite() ? "B: E^-1 B" : "A: E^-1 A") +
                               " is beyond the largest number, 1.8e308; choose other units");
}

// Says so where numbers left the range of double: instead of the reason for which a solve failed, or as the first
// warning about a solution that is of no use.
void NameWhatIsTooLarge(const Problem& problem, Solution& solution) {
  const bool reached = solution.termination == Termination::kReachedEnd;
  const Certificate& found = solution.certificate;
  const bool is_finite = !std::isinf(found.midpoint_residual) && !std::isinf(found.ode_defect) &&
                         !std::isinf(found.lcp_scale) && !std::isinf(found.ode_scale);
  if (reached && is_finite && JudgeSolution(solution).success) return;
  if (solution.termination == Termination::kCancelled || solution.termination == Termination::kUnsupported) return;
  // The last state that was finite; the next one may be much larger.
  const Index last = solution.x.cols() - 1;
  const bool has_end = last >= 0 && solution.y.cols() == last + 1;
  const std::string overflow =
      has_end ? OverflowAt(problem, solution.x.col(last), solution.y.col(last), solution.times.back())
              : OverflowAt(problem, problem.x0, Vector::Zero(problem.num_constraints()), 0);
  if (reached) {
    if (!overflow.empty()) solution.warnings.insert(solution.warnings.begin(), overflow);
  } else if (!overflow.empty()) {
    solution.termination = Termination::kNonFinite;
    solution.message = overflow;
  } else if (const std::string too_long = UnresolvedHorizon(problem); !too_long.empty()) {
    solution.message += " " + too_long;
  }
}

// What follows from a solution: measurements, and of a periodic one the averages of outputs.
absl::Status Measure(const Problem& problem, const Options& options, Solution& solution) {
  if (!solution.periodic) return MeasureOutputs(problem, !options.output_times_only, solution);
  PeriodicRecord& record = *solution.periodic;
  const bool is_given = options.period > 0;
  Problem of_period = is_given ? ProblemOfOnePeriod(problem, options.period).problem : problem;
  if (record.period > 0) {  // not after a search that ended before its first period
    of_period.horizon = record.period;
    auto means = MeanOutputs(of_period, solution);
    if (!means.ok()) return means.status();
    record.mean_outputs = *std::move(means);
  }
  const PeriodicExtension extension{.period = record.period, .horizon = problem.horizon, .has_clock = is_given};
  return MeasureOutputs(of_period, !options.output_times_only, solution, extension);
}

}  // namespace

absl::StatusOr<Solution> Solve(const Problem& problem, const Options& options, Observer& observer, std::stop_token stop,
                               SetupCache* setups, const ResumePoint* resume) {
  if (absl::Status status = CheckValid(problem, options); !status.ok()) return status;
  return SolveValidated(problem, options, observer, std::move(stop), setups, resume);
}

namespace {

// A problem with switches: event_driven alone locates the times at which they flip.
absl::StatusOr<Solution> SolveSwitched(const Problem& problem, const Options& options, Observer& observer,
                                       std::stop_token stop, const ResumePoint* resume) {
  if (options.method != Method::kAuto && options.method != Method::kEventDriven) {
    return InvalidField("method", "a problem with switches is solved by event-driven alone");
  }
  if (options.period != 0)
    return InvalidField("period", "no periodic state is computed for problems with switches yet");
  if (resume) return InvalidField("resume", "a solve with switches begins at 0");
  Options solved_with = options;
  solved_with.method = Method::kEventDriven;
  solved_with.keep_pieces = options.keep_pieces || HasMeasurements(problem);
  const Problem solved = WithConditionPairs(problem);
  auto solution = SolveUnlessStopped(solved, solved_with, observer, stop, nullptr, nullptr);
  if (!solution.ok()) return solution;
  NameWhatIsTooLarge(solved, *solution);
  if (HasMeasurements(problem)) {
    if (absl::Status measured = Measure(solved, options, *solution); !measured.ok()) return measured;
  }
  if (!options.keep_pieces) solution->pieces.clear();
  RemoveConditionPairs(problem.num_constraints(), *solution);
  return solution;
}

}  // namespace

absl::StatusOr<Solution> SolveValidated(const Problem& problem, const Options& options, Observer& observer,
                                        std::stop_token stop, SetupCache* setups, const ResumePoint* resume) {
  const StopScope scope(stop);
  try {
    if (!problem.switching.is_empty()) return SolveSwitched(problem, options, observer, stop, resume);
    if (absl::Status status = CheckSameInTeam(problem); !status.ok()) return status;
    Options solved_with = options;
    if (options.period != 0) solved_with.method = Method::kEventDriven;
    const bool averages = options.period != 0 && problem.outputs.shown() > 0;
    solved_with.keep_pieces = options.keep_pieces || HasMeasurements(problem) || averages;
    const std::optional<Problem> form = FormToSolve(problem, solved_with);
    const Problem& solved = form ? *form : problem;
    if (absl::Status status = CheckMultiplied(problem, solved); !status.ok()) return status;
    auto solution = options.period != 0 ? SolvePeriodic(solved, solved_with, observer, stop, setups)
                                        : SolveUnlessStopped(solved, solved_with, observer, stop, setups, resume);
    if (!solution.ok()) return solution;
    NameWhatIsTooLarge(problem, *solution);
    if (HasMeasurements(problem) || averages) {
      if (absl::Status measured = Measure(problem, options, *solution); !measured.ok()) return measured;
    }
    if (!options.keep_pieces) solution->pieces.clear();
    return solution;
  } catch (const Stopped&) {
    return StoppedBeforeTheStart(problem.num_states(), problem.num_constraints());
  }
}

}  // namespace dlcs
