// SPDX-License-Identifier: Apache-2.0
// Starts at which every guard vanishes: the rational complementarity problem says which of them rise.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/problem/verdict.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

// x' = y1 - y2, w1 = y1 - t^n, w2 = c t^(n+1) - x: y1 = t^n moves x to t^(n+1)/(n+1). For a constant y1 the state would
// be at t^(n+1) after t, and w2 below zero for every t.
TEST(ModeSearchTest, YCountsAsItGrows) {
  for (const int power : {1, 2, 3}) {
    Problem problem;
    problem.A = Matrix{{0}};
    problem.B = Matrix{{1, -1}};
    problem.N = Matrix{{0}, {-1}};
    problem.M = Matrix{{1, 0}, {0, 0}};
    problem.f = TimeFunction::Zero(1);
    const std::string n = std::to_string(power);
    problem.g = TimeFunction::Formulas({"-t^" + n, std::to_string(0.5 / (power + 1) + 0.5) + "*t^(" + n + "+1)"});
    problem.x0 = Vector{{0}};
    problem.horizon = 1;
    const Solution solution = testing::SolveAt(problem, 1e-8);
    EXPECT_EQ(JudgeSolution(solution).kind, VerdictKind::kSolved) << power << ": " << JudgeSolution(solution).text;
    EXPECT_EQ(solution.switching_times.size(), 1) << power;
    EXPECT_LE(solution.cost.lcps, 4) << power;
    for (Index k = 0; k < solution.x.cols(); ++k) {
      const double t = solution.times[static_cast<std::size_t>(k)];
      EXPECT_NEAR(solution.x(0, k), std::pow(t, power + 1) / (power + 1), 1e-8) << power << " at " << t;
    }
  }
}

// 0 <= y1 ⟂ x + y2 >= 0, 0 <= y2 ⟂ 1 - y1 >= 0: y1 = 1 where x < 0, and 0 where x > 0. x' = drift + pull y1.
Problem Relay(double x0, double drift, double pull) {
  Problem problem;
  problem.A = Matrix{{0}};
  problem.B = Matrix{{pull, 0}};
  problem.N = Matrix{{1}, {0}};
  problem.M = Matrix{{0, 1}, {-1, 0}};
  problem.f = TimeFunction::Constant(Vector{{drift}});
  problem.g = TimeFunction::Constant(Vector{{0, 1}});
  problem.x0 = Vector{{x0}};
  problem.horizon = 1;
  return problem;
}

// The relay repels: each h > 0 passes over the side on which x is.
TEST(ModeSearchTest, AStartBesideARelayThatRepelsIsOnItsSide) {
  for (const double x0 : {-1e-40, 1e-40, -1e-12, 1e-12}) {
    const Solution solution = testing::SolveAt(Relay(x0, 1, -2), 1e-8);
    EXPECT_EQ(JudgeSolution(solution).kind, VerdictKind::kSolved) << x0 << ": " << JudgeSolution(solution).text;
    EXPECT_NEAR(testing::LastState(solution)[0], x0 < 0 ? -1 : 1, 1e-8) << x0;
  }
}

// The state falls to zero and slides there, with y1 between 0 and 1.
TEST(ModeSearchTest, ARelayThatAttractsIsSlidOn) {
  Problem problem = Relay(0.5, -1, 2);
  const Solution solution = testing::SolveAt(problem, 1e-8);
  EXPECT_EQ(JudgeSolution(solution).kind, VerdictKind::kSolved) << JudgeSolution(solution).text;
  EXPECT_EQ(solution.switching_times.size(), 2);
  EXPECT_LE(solution.cost.lcps, 3);
  EXPECT_NEAR(testing::LastState(solution)[0], 0, 1e-12);
  EXPECT_NEAR(solution.y(0, Eigen::last), 0.5, 1e-8);
}

// An ideal diode stops to conduct where its current, w and w' are zero: neither values nor slopes decide.
TEST(ModeSearchTest, AContactIsLeftWhereOnlyTheSecondDerivativeDecides) {
  Problem problem;
  problem.A = Matrix{{0}};
  problem.B = Matrix{{1}};
  problem.N = Matrix{{1}};
  problem.M = Matrix{{0}};
  problem.f = TimeFunction::Formulas({"t-0.5"});
  problem.g = TimeFunction::Zero(1);
  problem.x0 = Vector{{0}};
  problem.horizon = 1;
  const Solution solution = testing::SolveAt(problem, 1e-8);
  EXPECT_EQ(JudgeSolution(solution).kind, VerdictKind::kSolved) << JudgeSolution(solution).text;
  ASSERT_EQ(solution.switching_times.size(), 2);
  EXPECT_NEAR(solution.switching_times[1].time, 0.5, 1e-12);
  EXPECT_NEAR(testing::LastState(solution)[0], 0.125, 1e-9);
}

}  // namespace
}  // namespace dlcs
