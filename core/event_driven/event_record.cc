// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/event_record.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/format_number.h"

namespace dlcs {
namespace {

std::vector<Index> Without(const std::vector<Index>& set, const std::vector<Index>& other) {
  std::vector<Index> difference;
  std::set_difference(set.begin(), set.end(), other.begin(), other.end(), std::back_inserter(difference));
  return difference;
}

}  // namespace

// Medians of 120 random systems of up to 40 states; single ones are off by up to three times.
Index EventRecord::Work(Index num_states) const {
  constexpr Index kOfAModePerState = 15;
  constexpr Index kOfACoupledStep = 3;  // one, and two of half its length
  return kOfASmoothStep * (steps + rejected_steps) + kOfAModePerState * num_states * modes_made +
         kOfACoupledStep * coupled_steps;
}

void EventRecord::Add(ModeInterval next) {
  if (!intervals.empty() && intervals.back().coupled == next.coupled && intervals.back().active == next.active) {
    intervals.back().end = next.end;
  } else {
    intervals.push_back(std::move(next));
  }
}

std::vector<SwitchingTime> SwitchingTimesOf(const EventRecord& record, const std::vector<double>& break_points,
                                            const std::vector<StateJump>& jumps) {
  const auto jumps_at = [&](double time) {
    return std::any_of(jumps.begin(), jumps.end(), [&](const StateJump& jump) { return jump.time == time; });
  };
  std::vector<SwitchingTime> times;
  const ModeInterval nothing;
  const ModeInterval* before = nullptr;
  for (const ModeInterval& interval : record.intervals) {
    const ModeInterval& last = before ? *before : nothing;
    SwitchingTime& switching = times.emplace_back();
    switching.time = interval.begin;
    switching.error = interval.begin_error;
    switching.entering = Without(interval.active, last.active);
    switching.leaving = Without(last.active, interval.active);
    if (interval.coupled) {
      switching.kind = SwitchingKind::kCoupledStepsBegin;
    } else if (last.coupled) {
      switching.kind = SwitchingKind::kCoupledStepsEnd;
    } else if (!before) {
      switching.kind = SwitchingKind::kStart;
    } else if (jumps_at(interval.begin)) {
      switching.kind = SwitchingKind::kJump;
    } else if (std::binary_search(break_points.begin(), break_points.end(), interval.begin)) {
      switching.kind = SwitchingKind::kBreakPoint;
    } else {
      switching.kind = SwitchingKind::kSwitch;
    }
    before = &interval;
  }
  return times;
}

std::string DescribeCoupledSteps(const EventRecord& record) {
  const ModeInterval* first = nullptr;
  Index stretches = 0;
  for (const ModeInterval& interval : record.intervals) {
    if (!interval.coupled) continue;
    if (!first) first = &interval;
    ++stretches;
  }
  if (!first) return "";
  return "No active set lasted from t = " + FormatNumber(first->begin) + " to " + FormatNumber(first->end) + " (" +
         first->why + ")" +
         (stretches > 1 ? ", and on " + std::to_string(stretches - 1) + " later intervals" : std::string()) + ": " +
         std::to_string(record.coupled_steps) + " coupled steps of first order were taken there.";
}

}  // namespace dlcs
