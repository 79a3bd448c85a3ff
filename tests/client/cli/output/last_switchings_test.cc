// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/last_switchings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Pairs 1 and 2 switch in turn, pair 3 once at the begin; each time after `ratio` of the time before.
v1::Summary Ended(int switchings, v1::Termination termination, v1::SwitchingKind kind = v1::SWITCHING_KIND_SWITCH,
                  double ratio = 1) {
  v1::Summary summary;
  summary.set_termination(termination);
  double at = 0, gap = 1e-3;
  for (int k = 0; k < switchings; ++k, at += gap, gap *= ratio) {
    v1::SwitchingTime& time = *summary.add_switching_times();
    time.set_time(at);
    time.set_kind(k == 0 ? v1::SWITCHING_KIND_START : kind);
    if (k < 2) time.add_entering(2);
    time.add_entering(k % 2);
    time.add_leaving(1 - k % 2);
  }
  summary.set_switchings(switchings);
  return summary;
}

const DisplayNames kNames{{}, {"S1", "D1", "D2"}};

TEST(LastSwitchingsTest, NamesWhatSwitchesAgainAndAgain) {
  const v1::Summary zeno = Ended(100, v1::TERMINATION_ITERATION_LIMIT, v1::SWITCHING_KIND_SWITCH, 0.9);
  EXPECT_THAT(AboutLastSwitchings(zeno, kNames),
              AllOf(HasSubstr("S1, D1 switch again and again, 32 times in the last"), Not(HasSubstr("D2"))));
  // It rests before it chatters.
  v1::Summary chatters = Ended(33, v1::TERMINATION_ITERATION_LIMIT);
  for (int k = 1; k < 33; ++k) chatters.mutable_switching_times(k)->set_time(5 + k * 1e-3);
  EXPECT_THAT(AboutLastSwitchings(chatters, kNames), HasSubstr("32 times in the last 0.031 s: a hysteresis"));
}

TEST(LastSwitchingsTest, BlamesNothingForALongHorizon) {
  EXPECT_EQ(AboutLastSwitchings(Ended(100, v1::TERMINATION_ITERATION_LIMIT), kNames),
            "switching 32 times in the last 0.031 s, as often as before: S1, D1");
}

TEST(LastSwitchingsTest, NamesTheLastSwitchingOfOthers) {
  EXPECT_EQ(AboutLastSwitchings(Ended(2, v1::TERMINATION_ITERATION_LIMIT), kNames),
            "the last to switch, at t = 0.001: S1, D1, D2");
  // A converter that a source drives switches often, too.
  EXPECT_THAT(AboutLastSwitchings(Ended(100, v1::TERMINATION_ITERATION_LIMIT, v1::SWITCHING_KIND_BREAK_POINT), kNames),
              HasSubstr("the last to switch"));
}

TEST(LastSwitchingsTest, SaysNothingWhereNothingIsKnown) {
  EXPECT_EQ(AboutLastSwitchings(Ended(100, v1::TERMINATION_REACHED_END), kNames), "");
  EXPECT_EQ(AboutLastSwitchings(Ended(1, v1::TERMINATION_ITERATION_LIMIT), kNames), "");
  v1::Summary more = Ended(100, v1::TERMINATION_ITERATION_LIMIT);
  more.set_switchings(10100);
  EXPECT_EQ(AboutLastSwitchings(more, kNames), "");
}

}  // namespace
}  // namespace dlcs::client
