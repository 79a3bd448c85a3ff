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

}  // namespace
}  // namespace dlcs
