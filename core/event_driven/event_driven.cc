// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/event_driven.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/event_driven/event_driven_loop.h"
#include "core/event_driven/event_record.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// If the options set the tolerance, a solve that misses it has failed to reach it.
bool MeetsTolerance(SolveContext& context, double tolerance, bool is_rounding, const EventRecord& record) {
  std::vector<std::string>& warnings = context.solution.warnings;
  if (record.coupled_steps > 0) warnings.push_back(DescribeCoupledSteps(record));
  if (record.errors.largest() <= tolerance) return true;
  const double largest = record.errors.largest();
  const std::string error =
      (std::isfinite(largest) ? "The estimated error, " + FormatNumber(largest) + " of the size of a component,"
                              : std::string("The estimated error grows beyond the range of numbers and")) +
      " is more than the tolerance " + FormatNumber(tolerance) +
      (is_rounding ? "; shorter steps do not help, since rounding, of the data too, changes the states by as much"
                   : "");
  if (context.options.error_tolerance > 0 && !context.error_by_default) {
    return context.Fail(Termination::kIterationLimit, std::numeric_limits<double>::quiet_NaN(),
                        error + ". The trajectory still reaches T.");
  }
  warnings.push_back(error + ".");
  return true;
}

// Estimates follow the steps of x. If y is not that of its steps, as where it is a difference of terms that are much
// larger, only the defect of x' shows that. It is far above the tolerance then: steps of high order have one near it,
// up to a thousand times as large where sources are not smooth. Between nodes of coupled steps y jumps.
void CountDefect(const Certificate& certificate, double tolerance, EventRecord& record) {
  constexpr double kFarAbove = 1e3, kSmallest = 1e-5;
  if (record.coupled_steps > 0 || !(certificate.ode_defect > 0)) return;
  const double defect = certificate.ode_defect / certificate.ode_scale;
  if (!(defect > std::max(kFarAbove * tolerance, kSmallest))) return;
  Vector& errors = record.errors.By.size() > 0 ? record.errors.By : record.errors.x;
  errors = errors.cwiseMax(defect);
}

// What is lost at events falls by leaps: only where steps of so much less error do not help is the rest rounding.
constexpr double kFarLess = 1e-4;

// Errors grow with the system: how much is known after the solve. The solve is repeated with as much less as it was
// missed by; with far less where a little did not help.
double NextTolerance(double tolerance, double wanted, double error, bool no_better) {
  constexpr double kMargin = 0.3;
  constexpr double kMaxAtOnce = 1e-6;
  const double factor = std::clamp(kMargin * wanted / error, kMaxAtOnce, kMargin);
  return std::max(1e-15, tolerance * (no_better ? std::min(factor, kFarLess) : factor));
}

// A solve that reached T, by steps of this tolerance. A later one may end before T, or lose more at its events.
struct Attempt {
  double tolerance = 0;
  EventRecord record;
  Solution solution;
  Certificate certificate;
  Index recorded = 0;
};

Attempt Save(const SolveContext& context, const EventRecord& record, double tolerance) {
  return {tolerance, record, context.solution, context.certificate.certificate(), context.recorder.recorded()};
}

void Restore(const Attempt& attempt, SolveContext& context, EventRecord& record) {
  record = attempt.record;
  context.solution = attempt.solution;
  context.certificate.Replace(attempt.certificate);
  context.recorder.ResumeFrom(attempt.recorded);
}

bool MaySolveAgain(int solves, Index work, const EventRecord& record) {
  constexpr int kMaxSolves = 3, kMaxShortSolves = 6;
  constexpr Index kShort = 60'000;
  constexpr Index kMaxCoupledStepsToRepeat = 1000;
  return record.coupled_steps <= kMaxCoupledStepsToRepeat && solves < (work < kShort ? kMaxShortSolves : kMaxSolves);
}

// The work of a solve whose steps have the tolerance `next`, after one of the tolerance `before` that took `work`.
Index WorkAt(double next, double before, Index work) {
  constexpr double kOrder = 12, kMargin = 1.1;
  return static_cast<Index>(kMargin * std::pow(before / next, 1 / kOrder) * static_cast<double>(work));
}

}  // namespace

bool EventDriven(SolveContext& context) {
  constexpr double kNoBetter = 0.7;
  constexpr double kFirstByDefault = 0.1;  // a second solve would cost more than somewhat shorter steps
  const double asked = context.options.error_tolerance;
  const double tolerance = asked > 0 ? asked : kDefaultEventTolerance;
  Solution& solution = context.solution;
  double of_steps =
      context.error_by_default ? kFirstByDefault * tolerance : std::min(tolerance, kLargestEventTolerance);
  // The default tolerance has a limit of work, of which a part is left for methods with fixed steps.
  const Index num_states = context.problem.num_states();
  const Index most_work = context.error_by_default ? MaxDefaultEventWork(context.options.output_times.size(),
                                                                         BreakPoints(context.problem).size())
                                                   : std::numeric_limits<Index>::max();
  Index work = 0;
  EventRecord record;
  std::optional<Attempt> best;
  bool reached = false, is_rounding = false;
  Index passes = 0;
  for (int solves = 1; true; ++solves) {
    std::vector<Index> small_but_known = std::move(record.small_but_known);
    record = {};
    record.small_but_known = std::move(small_but_known);
    EventDrivenLoop locator(context, of_steps, most_work - work, record);
    try {
      reached = locator.Run();
    } catch (const Stopped&) {
      context.FailCancelled(locator.reached());
    }
    locator.Finish();
    passes = solves;
    const Index work_of_solve = record.Work(num_states);
    work += work_of_solve;
    const bool was_cut = !reached;
    const bool no_better = best && !(record.errors.largest() < kNoBetter * best->record.errors.largest());
    is_rounding = best && reached && no_better && of_steps <= kFarLess * best->tolerance;
    if (best && !context.stop.stop_requested() &&
        !(reached && record.errors.largest() < best->record.errors.largest())) {
      Restore(*best, context, record);
      reached = true;
    }
    const double error = record.errors.largest();
    if (was_cut || !reached || error <= tolerance || !std::isfinite(error)) break;
    if (is_rounding || !MaySolveAgain(solves, work, record)) break;
    const double next = NextTolerance(of_steps, tolerance, error, no_better);
    if (most_work - work < WorkAt(next, of_steps, work_of_solve)) break;
    if (!best || error < best->record.errors.largest()) best = Save(context, record, of_steps);
    of_steps = next;
    context.recorder.ResumeFrom(0);
    solution.jumps.clear();
    solution.left_limits.clear();
    context.first_impulse.reset();
  }
  CountDefect(context.certificate.certificate(), tolerance, record);
  solution.switching_times = SwitchingTimesOf(record, BreakPoints(context.problem), solution.jumps);
  solution.step = record.longest_step;
  solution.cost.solves = passes;
  if (solution.flow) solution.flow->work = work;
  solution.accuracy.source = AccuracySource::kControlled;
  solution.accuracy.tolerance = tolerance;
  solution.accuracy.tolerance_is_default = context.error_by_default || asked == 0;
  solution.accuracy.error = NanMax(record.errors.largest(), Accuracy::kMinError);
  solution.accuracy.errors_x = record.errors.x.cwiseMax(Accuracy::kMinError);
  solution.accuracy.errors_By = record.errors.By.cwiseMax(Accuracy::kMinError);
  solution.accuracy.errors_w = record.errors.w.cwiseMax(Accuracy::kMinError);
  return reached && MeetsTolerance(context, tolerance, is_rounding, record);
}

}  // namespace dlcs
