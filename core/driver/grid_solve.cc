// SPDX-License-Identifier: Apache-2.0
#include "core/driver/grid_solve.h"

#include <limits>
#include <string>
#include <utility>

#include "core/context/checkpointing.h"
#include "core/context/solve_context.h"
#include "core/event_driven/event_driven.h"
#include "core/iteration/laplace_iteration.h"
#include "core/iteration/wu_chen_iteration.h"
#include "core/parallel/stop_scope.h"
#include "core/stepping/exponential_integrator.h"
#include "core/stepping/inelastic_impact.h"
#include "core/stepping/time_stepping.h"

namespace dlcs {
namespace {

bool RunUnlessStopped(const MethodChoice& choice, SolveContext& context) {
  if (choice.inelastic_impact) return InelasticImpact(context);
  switch (choice.method) {
    case Method::kLaplaceIteration:
      return LaplaceIteration(context);
    case Method::kWuChenIteration:
      return WuChenIteration(context);
    case Method::kTimeStepping:
      return TimeStepping(context);
    case Method::kEventDriven:
      return EventDriven(context);
    case Method::kExponentialIntegrator:
    case Method::kAuto:
      break;
  }
  return ExponentialIntegrator(context);
}

// The trajectory recorded before a stop is kept.
bool RunMethod(const MethodChoice& choice, SolveContext& context) {
  try {
    return RunUnlessStopped(choice, context);
  } catch (const Stopped&) {
    return context.FailCancelled(context.recorder.reached());
  }
}

}  // namespace

absl::StatusOr<Solution> SolveOnGrid(Task& task, const Grid& grid, Observer& observer, const ResumePoint* resume) {
  const auto begin = std::chrono::steady_clock::now();
  auto sources = Sources::Create(task.problem);
  if (!sources.ok()) return sources.status();
  Solution solution;
  solution.method = task.plan.method.method;
  solution.reason = task.plan.method.reason;
  solution.step = grid.longest_step;  // of event_driven its own
  solution.propagator = task.plan.propagator.record;
  SolveContext context{.problem = task.problem,
                       .options = task.options,
                       .matrix_class = task.plan.matrix_class,
                       .selection = task.plan.selection,
                       .grid = grid,
                       .sources = *std::move(sources),
                       .workers = task.workers,
                       .observer = observer,
                       .stop = task.stop,
                       .started = task.started,
                       .recorder = Recorder(grid, task.problem.num_states(), task.problem.num_constraints(), solution),
                       .certificate = CertificateBuilder(task.problem),
                       .solution = solution,
                       .choices = {.propagator = task.plan.propagator.system.get(),
                                   .setups = task.setups,
                                   .largest_slope = task.plan.largest_slope,
                                   .error_by_default = task.error_by_default,
                                   .two_stages = task.plan.method.two_stages,
                                   .without_contours = task.plan.method.without_contours},
                       .checkpoints = {.resume = resume, .makes = task.leaves_checkpoints},
                       .impulses = {.rows = task.plan.method.impulsive_rows}};
  if (!task.problem.outputs.limits.empty()) {
    auto watch = LimitWatch::Create(task.problem);
    if (!watch.ok()) return watch.status();
    context.limit_watch.emplace(*std::move(watch));
  }
  const bool is_first = task.stages.seconds_total == 0;
  solution.cost.seconds_setup = is_first ? context.Seconds() : SecondsSince(begin);
  if (RunMethod(task.plan.method, context)) {
    solution.termination = Termination::kReachedEnd;
    solution.message =
        "Reached T = " + FormatNumber(task.problem.horizon) + " in " + StepsText(solution.cost.steps) + ".";
  }
  const bool stopped = solution.termination == Termination::kCancelled;
  if (absl::Status resumed = ResumeStatus(context.checkpoints, stopped); !resumed.ok()) return resumed;
  if (context.impulses.first) {
    solution.warnings.push_back("y > 0 at t = " + FormatNumber(*context.impulses.first) + " in " +
                                task.plan.method.impulsive +
                                ", where only impulses can keep w >= 0: y grows there as the step shrinks, and x "
                                "depends on the method, not only on the system.");
  }
  task.lost_least_element = context.lost_least_element;
  context.recorder.Finish();
  solution.certificate = context.certificate.certificate();
  const CertificateRows& rows = context.certificate.rows();
  solution.largest = {rows.x_largest, rows.y_largest, rows.w_largest};
  // Impacts are jumps of x inside steps, and the integral of A x + B y + f does not contain them.
  if (task.plan.method.inelastic_impact) {
    solution.certificate.drift_of_rows = std::numeric_limits<double>::quiet_NaN();
  }
  const bool finite = solution.x.allFinite() && solution.y.allFinite() && solution.w.allFinite();
  if (!finite && solution.termination == Termination::kReachedEnd) {
    context.Fail(Termination::kNonFinite, task.problem.horizon, "The trajectory holds a number that is not finite.");
  }
  solution.cost.seconds_total = context.Seconds();
  solution.cost.AddStages(task.stages);
  task.stages = solution.cost;
  return solution;
}

}  // namespace dlcs
