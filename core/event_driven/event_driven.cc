// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/event_driven.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/context/sizes.h"
#include "core/event_driven/event_driven_loop.h"
#include "core/event_driven/event_record.h"
#include "core/event_driven/mode_sizes.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// Errors grow with the system: how much is known after the solve. The solve is repeated with as much less as it was
// missed by; with the least there is where that did not help, since what is lost at events falls by leaps.
double NextTolerance(double tolerance, double excess, bool no_better) {
  return no_better ? kUlp : std::max(kUlp, tolerance / (4 * excess));
}

// A solve that reached T, by steps of this tolerance. A later one may end before T, or lose more at its events.
struct Attempt {
  double tolerance = 0;
  double excess = 0;  // of its truncation
  EventRecord record;
  Solution solution;
  Certificate certificate;
  Index recorded = 0;
};

Attempt Save(const SolveContext& context, const EventRecord& record, double tolerance, double excess) {
  return {tolerance, excess, record, context.solution, context.certificate.certificate(), context.recorder.recorded()};
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
  return static_cast<Index>(std::pow(before / next, 1.0 / (kLegendreDegree - 1)) * static_cast<double>(work));
}

}  // namespace

bool EventDriven(SolveContext& context) {
  constexpr double kFirstByDefault = 0.1;  // a second solve costs more than shorter steps; EventDrivenTest feels it
  const double asked = context.options.error_tolerance;
  const double tolerance = asked > 0 ? asked : kDefaultEventTolerance;
  Solution& solution = context.solution;
  double of_steps =
      context.choices.error_by_default ? kFirstByDefault * tolerance : std::min(tolerance, kLargestEventTolerance);
  // The default tolerance has a limit of work, of which a part is left for methods with fixed steps.
  const Index num_states = context.problem.num_states();
  const Index most_work = context.choices.error_by_default ? MaxDefaultEventWork(context.options.output_times.size(),
                                                                                 BreakPoints(context.problem).size())
                                                           : std::numeric_limits<Index>::max();
  double allowed_rounding = 1;
  Index work = 0;
  EventRecord record;
  std::optional<Attempt> best;
  bool reached = false;
  Index passes = 0;
  for (int solves = 1; true; ++solves) {
    record = {};
    EventDrivenLoop locator(context, tolerance, of_steps, allowed_rounding, most_work, record);
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
    double excess = ExcessOfTruncation(record.errors, context.options, tolerance);
    const bool no_better = best && !(2 * excess < best->excess);
    const bool is_final = best && reached && no_better && of_steps == kUlp;
    if (best && !context.stop.stop_requested() && !(reached && excess < best->excess)) {
      Restore(*best, context, record);
      reached = true;
      excess = best->excess;
    }
    if (was_cut || !reached || excess <= 1 || !std::isfinite(excess)) break;
    if (is_final || !MaySolveAgain(solves, work, record)) break;
    const double next = NextTolerance(of_steps, excess, no_better);
    if (WorkAt(next, of_steps, work_of_solve) / EventRecord::kPatience > most_work) break;
    if (!best || excess < best->excess) best = Save(context, record, of_steps, excess);
    of_steps = next;
    allowed_rounding *= kOfNoise;
    context.recorder.ResumeFrom(0);
    solution.jumps.clear();
    solution.left_limits.clear();
    solution.flips.clear();
    context.impulses.first.reset();
  }
  solution.switching_times = SwitchingTimesOf(record, BreakPoints(context.problem), solution.jumps);
  solution.step = record.longest_step;
  solution.cost.solves = passes;
  if (solution.flow) solution.flow->work = work;
  solution.accuracy.source = AccuracySource::kControlled;
  solution.accuracy.tolerance = tolerance;
  solution.accuracy.tolerance_is_default = context.choices.error_by_default || asked == 0;
  solution.accuracy.errors = record.errors;
  JudgeBesideModes(context.problem, context.selection, context.options, solution);
  if (record.coupled_steps > 0) solution.warnings.push_back(DescribeCoupledSteps(record));
  return reached;
}

}  // namespace dlcs
