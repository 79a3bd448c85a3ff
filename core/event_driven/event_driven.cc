// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/event_driven.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/event_driven/event_locator.h"
#include "core/event_driven/event_record.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// If the options set the tolerance, a solve that misses it has failed to reach it.
bool MeetsTolerance(SolveContext& context, double tolerance, bool is_rounding, const EventRecord& record) {
  std::vector<std::string>& warnings = context.solution.warnings;
  if (record.marched_steps > 0) warnings.push_back(DescribeMarches(record));
  if (record.accumulated_error <= tolerance) return true;
  const std::string error =
      "The estimated error, " + FormatNumber(record.accumulated_error) +
      " of the size of a state, is more than the tolerance " + FormatNumber(tolerance) +
      (is_rounding ? "; shorter steps do not help, since rounding, that of the data too, moves the states by as much"
                   : "");
  if (context.options.error_tolerance > 0 && !context.error_by_default) {
    return context.Fail(Termination::kIterationLimit, std::numeric_limits<double>::quiet_NaN(),
                        error + ". The trajectory reaches T all the same.");
  }
  warnings.push_back(error + ".");
  return true;
}

// What is lost at events falls by leaps: only where steps of so much less error do not help is the rest rounding.
constexpr double kFarLess = 1e-4;

// Errors grow with the system: how much is known behind the solve. The solve is repeated with as much less as it was
// missed by; with far less where a little did not help.
double NextTolerance(double tolerance, double wanted, double error, bool no_better) {
  constexpr double kMargin = 0.3;
  constexpr double kMostAtOnce = 1e-6;
  const double factor = std::clamp(kMargin * wanted / error, kMostAtOnce, kMargin);
  return std::max(1e-15, tolerance * (no_better ? std::min(factor, kFarLess) : factor));
}

}  // namespace

bool EventDriven(SolveContext& context) {
  constexpr int kMostSolves = 3;
  constexpr double kNoBetter = 0.7;
  constexpr double kFirstByDefault = 0.1;  // a second solve would cost more than somewhat shorter steps
  constexpr Index kMostMarchedAgain = 1000;
  const double asked = context.options.error_tolerance;
  const double tolerance = asked > 0 ? std::min(asked, kLargestEventTolerance) : kDefaultEventTolerance;
  Solution& solution = context.solution;
  double of_steps = context.error_by_default ? kFirstByDefault * tolerance : tolerance;
  double of_steps_before = of_steps;
  double error_before = std::numeric_limits<double>::infinity();
  // The default tolerance has a limit of work, of which a part is left for methods with fixed steps.
  const Index num_states = context.problem.num_states();
  const Index most_work = context.error_by_default ? kMostDefaultEventWork : std::numeric_limits<Index>::max();
  Index work = 0;
  EventRecord record;
  bool reached = false, is_rounding = false;
  for (int solves = 1; true; ++solves) {
    record = {};
    EventLocator locator(context, of_steps, most_work - work, record);
    try {
      reached = locator.Run();
    } catch (const Stopped&) {
      context.FailCancelled(locator.reached());
    }
    locator.Finish();
    work += record.Work(num_states);
    const double error = record.accumulated_error;
    const bool no_better = solves > 1 && error >= kNoBetter * error_before;
    is_rounding = no_better && of_steps <= kFarLess * of_steps_before;
    if (!reached || error <= tolerance || !std::isfinite(error)) break;
    if (solves == kMostSolves || is_rounding || record.marched_steps > kMostMarchedAgain) break;
    if (most_work - work < 2 * record.Work(num_states)) break;
    error_before = error;
    of_steps_before = of_steps;
    of_steps = NextTolerance(of_steps, tolerance, error, no_better);
    context.recorder.GoOnFrom(0);
    solution.jumps.clear();
    solution.left_limits.clear();
    context.first_impulse.reset();
  }
  solution.switching_times = SwitchingTimesOf(record, BreakPoints(context.problem), solution.jumps);
  solution.step = record.longest_step;
  solution.accuracy.source = AccuracySource::kControlled;
  solution.accuracy.asked = tolerance;
  solution.accuracy.asked_by_default = context.error_by_default || asked == 0;
  solution.accuracy.error = NanMax(record.accumulated_error, Accuracy::kLeastError);
  solution.accuracy.errors_x = record.errors_x.cwiseMax(Accuracy::kLeastError);
  return reached && MeetsTolerance(context, tolerance, is_rounding, record);
}

}  // namespace dlcs
