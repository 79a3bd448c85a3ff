// SPDX-License-Identifier: Apache-2.0

#include "core/methods/event_located.h"

#include <algorithm>
#include <limits>

#include "core/events/event_locator.h"
#include "core/events/event_record.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// Where the tolerance was asked for, a solve that has not met it has not reached what it should.
bool MeetsTolerance(SolveContext& context, double tolerance, const EventRecord& record) {
  std::vector<std::string>& warnings = context.solution.warnings;
  if (record.marched_steps > 0) warnings.push_back(DescribeMarches(record));
  if (record.accumulated_error <= tolerance) return true;
  const std::string errors = "The estimated errors of the steps add up to " +
                             FormatNumber(record.accumulated_error) +
                             " of the size of x, more than the tolerance " + FormatNumber(tolerance);
  if (context.options.error_tolerance > 0 && !context.error_by_default) {
    return context.Fail(Termination::kIterationLimit, std::numeric_limits<double>::quiet_NaN(),
                        errors + ". The trajectory reaches T all the same.");
  }
  warnings.push_back(errors + ".");
  return true;
}

}  // namespace

bool EventLocated(SolveContext& context) {
  const double asked = context.options.error_tolerance;
  const double tolerance = asked > 0 ? std::min(asked, kLargestEventTolerance) : kDefaultEventTolerance;
  EventRecord record;
  EventLocator locator(context, tolerance, record);
  bool reached = false;
  try {
    reached = locator.Run();
  } catch (const Stopped&) {
    context.FailCancelled(locator.reached());
  }
  locator.Finish();
  Solution& solution = context.solution;
  solution.switching_times = SwitchingTimesOf(record, BreakPoints(context.problem), solution.jumps);
  solution.step = record.longest_step;
  solution.accuracy.source = AccuracySource::kControlled;
  solution.accuracy.asked = tolerance;
  solution.accuracy.asked_by_default = context.error_by_default || asked == 0;
  solution.accuracy.error = std::max(record.accumulated_error, Accuracy::kLeastError);
  return reached && MeetsTolerance(context, tolerance, record);
}

}  // namespace dlcs
