// SPDX-License-Identifier: Apache-2.0
// States that stay much closer to a constraint than the tolerance, or start there.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
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

// From t = 0.722 on y_2 = (t - 0.722)^3, and y_1 follows so that w_1 stays zero. By itself y_2 would drive w_2 up, with
// y_1 it drives it down at a rate of 3e7: rounding decides whether y_2 ever begins, and no solve can know.
TEST(NearConstraintsTest, APairThatAnotherRepelsIsNoticed) {
  const std::string y1 = "sin(0.756*t)*sin(1.929*t)", y2 = "max(0, t - 0.722)**3", w2 = "max(0, 0.722 - t)**3";
  const std::string x1 = "(t**2)", x2 = "sin(1.184*t)";
  Problem problem;
  problem.A = Matrix{{-5, 0.33}, {-1.8, -3.42}};
  problem.B = Matrix{{0.4, -0.06}, {-0.43, 0.7}};
  problem.N = Matrix{{0.56, -1.79}, {-0.6, 0.71}};
  problem.M = Matrix{{3.298e-8, -1.2e-9}, {-4.236e-8, 2.212e-8}};
  problem.f =
      TimeFunction::Formulas({"2*t + 5*" + x1 + " - 0.33*" + x2 + " - 0.4*" + y1 + " + 0.06*" + y2,
                              "1.184*cos(1.184*t) + 1.8*" + x1 + " + 3.42*" + x2 + " + 0.43*" + y1 + " - 0.7*" + y2});
  problem.g =
      TimeFunction::Formulas({"-0.56*" + x1 + " + 1.79*" + x2 + " - 3.298e-8*" + y1 + " + 1.2e-9*" + y2,
                              w2 + " + 0.6*" + x1 + " - 0.71*" + x2 + " + 4.236e-8*" + y1 + " - 2.212e-8*" + y2});
  problem.x0 = Vector{{0.0, 0.0}};
  problem.horizon = 1.3;
  Options options;
  options.error_tolerance = 1e-6;
  options.output_times = {1.3};
  options.output_times_only = true;
  const Solution solution = testing::SolveWith(problem, options);
  ASSERT_EQ(solution.x.cols(), 1);
  const double error = std::abs(solution.x(0, 0) / 1.69 - 1);
  EXPECT_LE(error, 3 * solution.accuracy.error + 1e-12);
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
