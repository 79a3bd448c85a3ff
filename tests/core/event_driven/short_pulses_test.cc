// SPDX-License-Identifier: Apache-2.0
// Smooth pulses that are short beside T, between the nodes of every step that the rest of the system asks for.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "core/problem/verdict.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

// x' = f, so that x(T) is the area under f.
double AreaUnder(const std::string& f, double horizon) {
  Problem problem = testing::Scalar(0, 1, 0, horizon);
  problem.B = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Formulas({f});
  const Solution solution = testing::SolveAt(problem, 1e-9);
  EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_LE(testing::FigureOf(solution.accuracy.errors.x), 1e-9);
  return testing::LastState(solution)[0];
}

class ShortPulsesTest : public ::testing::TestWithParam<int> {};

// Pulses of 1.7 % of a period, over so many periods.
TEST_P(ShortPulsesTest, OfATrainNoneIsMissed) {
  const double periods = GetParam();
  const double width = 0.017;
  const double gaussian = std::sqrt(std::numbers::pi) * width;
  EXPECT_NEAR(AreaUnder("exp(-((t - floor(t) - 0.5)/0.017)**2)", periods) / periods, gaussian, 1e-9 * gaussian);
  // The mean of cos(πt)^n is that of the binomial coefficients, (n choose n/2) / 2^n.
  const double n = 20'000;
  const double power = std::exp(std::lgamma(n + 1) - 2 * std::lgamma(n / 2 + 1) - n * std::numbers::ln2);
  EXPECT_NEAR(AreaUnder("cos(pi*t)**20000", periods) / periods, power, 1e-9 * power);
  EXPECT_NEAR(AreaUnder("1 + cos(pi*t)**20000", periods) / periods, 1 + power, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Periods, ShortPulsesTest, ::testing::Values(1, 2, 7, 30, 100, 300));

TEST(ShortPulseTest, OfOneIsNotMissedHoweverShortItIs) {
  for (const char* width : {"1e-2", "1e-4", "1e-6"}) {
    SCOPED_TRACE(width);
    const double w = std::stod(width);
    const std::string u = std::string("((t - 0.5123)/") + width + ")";
    EXPECT_NEAR(AreaUnder("exp(-" + u + "**2)", 1) / w, std::sqrt(std::numbers::pi), 1e-8);
    EXPECT_NEAR(AreaUnder("1/cosh(" + u + ")**2", 1) / w, 2, 1e-8);
  }
}

// Where a part of the formula overflows or vanishes beside the pulse, and where others have singular points, or
// switches that rounding hides.
TEST(ShortPulseTest, OfOneIsNotMissedBesideAnything) {
  const double pi = std::numbers::pi, gaussian = std::sqrt(pi);
  const std::string pulse = "1e6*exp(-((t - 0.5123)/1e-6)**2)";
  EXPECT_NEAR(AreaUnder("1 + 100/cosh(1000*(t - 3))**2", 10), 10.2, 1e-7);
  EXPECT_NEAR(AreaUnder("1 + 1e5/(exp(1e5*(t - 0.3)) + exp(-1e5*(t - 0.3)))", 1), 1 + pi / 2, 1e-8);
  EXPECT_NEAR(AreaUnder("3 - 1e5/exp(((t - 0.3)/1e-5)**2)", 1), 3 - gaussian, 1e-8);
  EXPECT_NEAR(AreaUnder("sqrt(sin(100*pi*t)**2) + " + pulse, 1), 2 / pi + gaussian, 1e-7);
  EXPECT_NEAR(AreaUnder("asin(cos(8*pi*t)) + " + pulse, 1), gaussian, 1e-7);
  EXPECT_NEAR(AreaUnder("abs(cos(t)**2 + sin(t)**2 - 1) + " + pulse, 1), gaussian, 1e-7);
  EXPECT_NEAR(AreaUnder("exp(-1/t) + " + pulse, 1), gaussian + 0.14849550677592205, 1e-7);  // the exponential integral
}

// Its root is hidden by rounding near the zeros of the operand.
TEST(ShortPulseTest, ARootThatTouchesZeroIsSolved) {
  EXPECT_NEAR(AreaUnder("sqrt(1 - cos(t))", 6 * std::numbers::pi), 12 * std::numbers::sqrt2, 1e-6);
}

TEST(ShortPulseTest, AFastOscillationIsSolvedByDefault) {
  constexpr double kRate = 1e4, kEnd = 10;
  Problem problem = testing::Scalar(-1, 1, 0, kEnd);
  problem.B = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Formulas({"sin(1e4*t)"});
  const Solution solution = testing::SolveForEnd(problem);
  const double exact =
      (std::sin(kRate * kEnd) - kRate * std::cos(kRate * kEnd) + kRate * std::exp(-kEnd)) / (1 + kRate * kRate);
  EXPECT_EQ(solution.method, Method::kEventDriven);
  EXPECT_NEAR(testing::LastState(solution)[0], exact, 1e-6 * 2 / kRate);
}

// Between all nodes of all grids, whose solutions agree.
TEST(ShortPulseTest, FixedStepsThatSeeNoneKnowIt) {
  const double area = std::sqrt(std::numbers::pi) * 1e-6;
  Problem problem = testing::Scalar(-1, 1, 0, 1);
  problem.f = TimeFunction::Formulas({"exp(-((t - 0.5123)/1e-6)**2)"});
  for (const Method method :
       {Method::kTimeStepping, Method::kExponentialIntegrator, Method::kLaplaceIteration, Method::kWuChenIteration}) {
    SCOPED_TRACE(MethodName(method));
    for (const double tolerance : {0.0, 1e-3}) {
      Options options;
      options.method = method;
      options.error_tolerance = tolerance;
      options.estimate_error = true;
      if (tolerance == 0) options.num_steps = 1000;
      const Solution solution = testing::SolveWith(problem, options);
      EXPECT_GT(solution.accuracy.errors.x.truncation[0], area / 3);
      EXPECT_LT(solution.accuracy.errors.x.truncation[0], 3 * area);
      EXPECT_FALSE(JudgeSolution(solution).success);
    }
  }
}

}  // namespace
}  // namespace dlcs
