// SPDX-License-Identifier: Apache-2.0

#include "core/periodic/period_map.h"

#include <gtest/gtest.h>

namespace dlcs {
namespace {

// A period from the branch with `before` to the one with `end`, where y has been 1.
bool Repeats(const Vector& before, const Vector& end) {
  PeriodSolve solve;
  solve.y_before = before;
  solve.y_size = Vector::Ones(before.size());
  return solve.IsOnBranch(end);
}

TEST(IsOnBranchTest, APairThatSwitchedIsOnAnotherBranch) {
  EXPECT_TRUE(Repeats(Vector{{1, 0}}, Vector{{0.5, 0}}));
  EXPECT_FALSE(Repeats(Vector{{1, 0}}, Vector{{0.5, 0.5}}));
  EXPECT_FALSE(Repeats(Vector{{1, 0}}, Vector{{0, 0}}));
}

// Before the search is near, y is off by as much as x: what is hardly positive may be zero in the periodic solution.
TEST(IsOnBranchTest, APairNearZeroHasNotSwitched) {
  EXPECT_TRUE(Repeats(Vector{{1, 0}}, Vector{{1, 5e-4}}));
  EXPECT_TRUE(Repeats(Vector{{1, 5e-4}}, Vector{{1, 0}}));
}

// A comparator that has switched rests at zero up to the errors of the period.
TEST(IsOnBranchTest, ZeroIsKnownToTheErrorsOfThePeriod) {
  EXPECT_FALSE(Repeats(Vector{{1, 0}}, Vector{{5e-10, 0}}));
  EXPECT_FALSE(Repeats(Vector{{5e-10, 0}}, Vector{{1, 0}}));
}

// Without the rule history x determines y.
TEST(IsOnBranchTest, WithoutHistoryThereIsOneBranch) { EXPECT_TRUE(PeriodSolve().IsOnBranch(Vector())); }

}  // namespace
}  // namespace dlcs
