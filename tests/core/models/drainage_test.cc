// SPDX-License-Identifier: Apache-2.0
#include "core/models/drainage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/linalg/norms.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::SolveForEnd;

Solution Solved(const DrainageModel& model) {
  const auto problem = MakeDrainageProblem(model);
  EXPECT_TRUE(problem.ok()) << problem.status();
  return SolveForEnd(*problem);
}

TEST(DrainageTest, TheDrainsAtLastCarryAllThatFalls) {
  for (const Index dimensions : {1, 2}) {
    const DrainageModel model{.cells = dimensions == 1 ? Index{42} : Index{14},  // drains in the middle of cells
                              .dimensions = dimensions,
                              .drains = 2,
                              .coefficient = 1,
                              .horizon = 40,
                              .recharge = "0.3"};
    const Solution solution = Solved(model);
    EXPECT_NEAR(solution.y.sum(), 0.3, 1e-5) << dimensions;
    EXPECT_LE(solution.y.maxCoeff() - solution.y.minCoeff(), 1e-5) << "each the same";
  }
}

TEST(DrainageTest, DrainsGiveNothingBack) {
  const Solution dry = Solved({.cells = 30, .drains = 3, .coefficient = 1, .horizon = 3, .recharge = "-1"});
  EXPECT_LE(MaxAbs(dry.y), 0) << "below the drains";
  EXPECT_LT(dry.x.maxCoeff(), 0);
}

TEST(DrainageTest, NamesEachBrokenRule) {
  const auto problem = MakeDrainageProblem({.cells = 4, .drains = 5, .coefficient = -1, .conductance = 0});
  EXPECT_THAT(problem.status().message(), AllOf(HasSubstr("drains: is 5, must be from 1 to the 4 cells"),
                                                HasSubstr("coefficient"), HasSubstr("conductance")));
}

}  // namespace
}  // namespace dlcs
