// SPDX-License-Identifier: Apache-2.0
#include "core/solve.h"

#include <chrono>
#include <optional>
#include <utility>

#include "core/driver/error_control.h"
#include "core/driver/fallback.h"
#include "core/driver/grid_solve.h"
#include "core/driver/plan.h"
#include "core/driver/propagator_choice.h"
#include "core/driver/report.h"
#include "core/outputs/measure_outputs.h"
#include "core/parallel/stop_scope.h"
#include "core/problem/validate.h"

namespace dlcs {

namespace {

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

}  // namespace

absl::StatusOr<Solution> Solve(const Problem& problem, const Options& options, Observer& observer, std::stop_token stop,
                               SetupCache* setups, const ResumePoint* resume) {
  if (absl::Status status = CheckValid(problem, options); !status.ok()) return status;
  return SolveValidated(problem, options, observer, std::move(stop), setups, resume);
}

absl::StatusOr<Solution> SolveValidated(const Problem& problem, const Options& options, Observer& observer,
                                    std::stop_token stop, SetupCache* setups, const ResumePoint* resume) {
  const StopScope scope(stop);
  try {
    const std::optional<Problem> form = FormToSolve(problem, options);
    Options kept = options;
    kept.keep_pieces = options.keep_pieces || HasMeasurements(problem);
    auto solution = SolveUnlessStopped(form ? *form : problem, kept, observer, stop, setups, resume);
    if (!solution.ok()) return solution;
    if (absl::Status measured = MeasureOutputs(problem, *solution); !measured.ok()) return measured;
    if (!options.keep_pieces) solution->pieces.clear();
    return solution;
  } catch (const Stopped&) {
    return StoppedBeforeTheStart(problem.num_states(), problem.num_constraints());
  }
}

}  // namespace dlcs
