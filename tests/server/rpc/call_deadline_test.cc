// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/call_deadline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>

namespace dlcs {
namespace {

using std::chrono::system_clock;

// How long before a deadline in `left_s` seconds a solve is stopped.
double Margin_s(double left_s, std::int64_t result_bytes) {
  const auto left = std::chrono::duration_cast<system_clock::duration>(std::chrono::duration<double>(left_s));
  const auto deadline = system_clock::now() + left;
  const auto stop = StopTime(deadline, result_bytes);
  return std::chrono::duration<double>(deadline - stop.value()).count();
}

// Time passes between the computation of the deadline and the call.
auto Near(double seconds) { return ::testing::DoubleNear(seconds, 0.01 * seconds); }

TEST(CallDeadlineTest, LeavesATenthButAtLeastAQuarterOfASecondAndAtMostOne) {
  EXPECT_THAT(Margin_s(5, 0), Near(0.5));
  EXPECT_THAT(Margin_s(1, 0), Near(0.25));
  EXPECT_THAT(Margin_s(60, 0), Near(1));
}

TEST(CallDeadlineTest, LeavesTheTimeThatTheResultTakes) { EXPECT_THAT(Margin_s(60, 200'000'000), Near(3)); }

TEST(CallDeadlineTest, LeavesHalfForTheSolve) {
  EXPECT_THAT(Margin_s(0.3, 0), Near(0.15));
  EXPECT_THAT(Margin_s(4, 2'000'000'000), Near(2));
}

TEST(CallDeadlineTest, WithoutADeadlineThereIsNoStop) {
  EXPECT_FALSE(StopTime(system_clock::time_point::max(), 0).has_value());
}

}  // namespace
}  // namespace dlcs
