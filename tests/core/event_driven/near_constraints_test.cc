// SPDX-License-Identifier: Apache-2.0
// States that stay much closer to a constraint than the tolerance, or start there.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/event_driven/mode_end.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

// x_1 = sin(12 t) keeps a distance of 1e-9 max(0, -sin(0.683 t)) from the constraint of pair 2, which holds it only
// where that is zero. Pair 1 switches all the while, and at each switch the active set is looked for again. x_2, of
// size 1e-6, integrates the error of x_1 and so shows where x_1 was moved onto the constraint.
TEST(NearConstraintsTest, AStateIsNotMovedOntoAConstraintThatDoesNotHold) {
  Problem problem;
  problem.A = Matrix{{0.0, 0.0}, {1.0, 0.0}};
  problem.B = Matrix{{0.0, 1.0}, {0.0, 0.0}};
  problem.N = Matrix{{0.0, 0.0}, {1.0, 0.0}};
  problem.M = Matrix{{1.0, 0.0}, {0.0, 0.0}};
  problem.f = TimeFunction::Formulas({"12*cos(12*t) - 1e-9*max(0, sin(0.683*t))", "0.731e-6*cos(0.731*t) - sin(12*t)"});
  problem.g = TimeFunction::Formulas({"-sin(11*t)", "1e-9*max(0, -sin(0.683*t)) - sin(12*t)"});
  problem.x0 = Vector{{0.0, 0.0}};
  problem.horizon = 9;
  Options options;
  options.error_tolerance = 1e-6;
  for (int k = 1; k <= 90; ++k) options.output_times.push_back(0.1 * k);
  options.output_times_only = true;
  const Solution solution = testing::SolveWith(problem, options);
  ASSERT_EQ(solution.x.cols(), 90);
  double error = 0;
  for (Index k = 0; k < solution.x.cols(); ++k) {
    const double t = solution.times[static_cast<std::size_t>(k)];
    error = std::max(error, std::abs(solution.x(1, k) / 1e-6 - std::sin(0.731 * t)));
  }
  EXPECT_LE(error, 1e-6);
  EXPECT_LE(error, 3 * solution.accuracy.error);
}

// Between y = 0 and the solution that leaves it as e^{rate t} rounding decides, also where no step is as long as that
// takes.
TEST(RepelledStartsTest, GrowOverStepsUntilRoundingDecides) {
  constexpr double kNoise = 1e-16, kRate = 15;  // 30 times in a step
  const LegendreVector zero = LegendreVector::Zero();
  RepelledStarts starts(1);
  EXPECT_EQ(starts.Follow(0, zero, kRate, kNoise, 1), 0);
  EXPECT_NEAR(starts.Follow(0, zero, kRate, kNoise, 1) / (kNoise * std::exp(40)), 1, 0.2);
}

TEST(RepelledStartsTest, AreNoneWhereTheConstraintIsLeftAtOnce) {
  LegendreVector rising = LegendreVector::Zero();
  rising[0] = rising[1] = 1e-3;  // (1 + s) / 1000
  RepelledStarts starts(1);
  for (int step = 0; step < 3; ++step) EXPECT_EQ(starts.Follow(0, rising, 15, 1e-16, 1), 0);
}

TEST(RepelledStartsTest, EndWithTheirMode) {
  const LegendreVector zero = LegendreVector::Zero();
  RepelledStarts starts(1);
  for (int step = 0; step < 3; ++step) {
    EXPECT_EQ(starts.Follow(0, zero, 15, 1e-16, 1), 0);
    starts.End(0);
  }
}

}  // namespace
}  // namespace dlcs
