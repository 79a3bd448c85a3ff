// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/step_length.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <utility>
#include <vector>

#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;

constexpr double kLengthInfinity = std::numeric_limits<double>::infinity();
// A local error is one power of the length higher than what is allowed of it.
constexpr int kLengthPower = kLegendreDegree - 1;

Mode LengthModeWith(std::vector<std::complex<double>> eigenvalues, double rate = 0) {
  Mode mode;
  mode.eigenvalues = std::move(eigenvalues);
  mode.rate = rate;
  return mode;
}

Mode LengthModeOf(const Matrix& dynamics) {
  const Index m = dynamics.rows();
  Problem problem;
  problem.A = dynamics;
  problem.B = Matrix::Zero(m, 1);
  problem.N = Matrix::Zero(1, m);
  problem.M = Matrix::Identity(1, 1);
  problem.horizon = 1;
  return *ModeMaker(problem).Make({}, {Vector::Ones(m), Vector::Ones(m), Vector::Ones(1)});
}

SmoothStep LengthStepWith(double error_ratio, double layer = kLengthInfinity, double small_layer = kLengthInfinity) {
  SmoothStep step;
  step.error_ratio = error_ratio;
  step.layer_length = layer;
  step.small_layer_length = small_layer;
  return step;
}

TEST(StepLengthTest, NextIsAllThatIsLeftOrAtMostHalf) {
  const StepLength length(100, 1);
  const Mode mode = LengthModeWith({-1});
  for (const double left : {1e-9, 0.3, 1.0}) EXPECT_EQ(length.Next(mode, left), left);
  for (const double left : {1.001, 1.5, 1.999}) EXPECT_EQ(length.Next(mode, left), left / 2);
  for (const double left : {2.0, 3.0, 100.0}) EXPECT_EQ(length.Next(mode, left), 1);
}

TEST(StepLengthTest, NoStepGrowsBeyondWhatItsPolynomialShows) {
  // exp(6) is the Padé approximation to rounding.
  const StepLength length(100, 100);
  for (const double growth : {0.1, 3.0, 1e6}) {
    const double next = length.Next(LengthModeWith({-1e9, {growth, 50 * growth}, growth / 2}), 1e9);
    EXPECT_LE(next * growth, 6 * (1 + 1e-15));
    EXPECT_GE(next * growth, 3);
  }
  // What decays or rotates is bounded by its error alone.
  EXPECT_EQ(length.Next(LengthModeWith({-1e9, {0, 1e3}}), 1e9), 100);
  EXPECT_EQ(length.Next(LengthModeWith({}), 1e9), 100);
}

TEST(StepLengthTest, TheFirstStepIsThatOfTheFastestEigenvalue) {
  for (const std::complex<double> fastest : {std::complex<double>(-80), {0, 80}, {48, -64}}) {
    StepLength length(10, 10);
    length.BeginWith(LengthModeWith({-1, fastest, {0, 2}}));
    EXPECT_GE(length.value() * 80, 1) << fastest;
    EXPECT_LE(length.value() * 80, 6) << fastest;
  }
  for (const std::vector<std::complex<double>>& slow : {std::vector<std::complex<double>>{}, {0}, {-1e-3, 1e-4}}) {
    StepLength length(10, 3);
    length.BeginWith(LengthModeWith(slow));
    EXPECT_EQ(length.value(), 10);
  }
}

TEST(StepLengthTest, TheFirstStepHasNoUnitsOfStates) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Matrix A = RandomMatrix(5, 5, seed);
    const Vector units{{1, 1e-6, 1e3, 1e7, 1e-2}};
    const double time = 1e-5;
    StepLength length(100, 1), in_other_units(100 * time, 1);
    length.BeginWith(LengthModeOf(A));
    in_other_units.BeginWith(LengthModeOf(units.asDiagonal() * A * units.cwiseInverse().asDiagonal() / time));
    EXPECT_NEAR(in_other_units.value() / time / length.value(), 1, 1e-6) << seed;
    EXPECT_LT(length.value(), 100) << seed;
  }
}

TEST(StepLengthTest, AnAccurateStepIsFollowedByOneThatIsJustAllowed) {
  // Ratios at which no limit cuts the length.
  for (const double ratio : {0.1, 1e-3, 1e-6, 1e-11}) {
    StepLength length(1e9, 2);
    length.Accept(2, ratio);
    const double grown = length.value() / 2;
    EXPECT_GT(grown, 1) << ratio;
    const double next_ratio = ratio * std::pow(grown, kLengthPower);
    EXPECT_LE(next_ratio, 1) << ratio;
    EXPECT_GE(next_ratio, 0.1) << ratio;
  }
}

TEST(StepLengthTest, AnAccurateStepNeverShortensAndNeverLeaps) {
  for (const double ratio : {0.0, 1e-300, 1e-20, 0.5, 1.0}) {
    StepLength length(1e9, 2);
    length.Accept(2, ratio);
    EXPECT_GE(length.value(), 2) << ratio;
    EXPECT_LE(length.value(), 32) << ratio;
  }
  // A step that an event or a break point cut short says nothing against longer ones.
  StepLength length(1e9, 2);
  length.Accept(1e-6, 0.9);
  EXPECT_EQ(length.value(), 2);
}

TEST(StepLengthTest, LongerStepsAreTriedNowAndThenWhereRoundingHidesTheError) {
  StepLength length(1e9, 1);
  int tried = 0, together = 0;
  for (int k = 0; k < 64; ++k) {
    const double before = length.value();
    length.Accept(before, 0.9);
    const bool grows = length.value() > before;
    together = grows ? together + 1 : 0;
    EXPECT_LE(together, 1);
    tried += grows;
  }
  EXPECT_GE(tried, 4);
  EXPECT_LE(tried, 16);
}

TEST(StepLengthTest, ARepeatedStepIsAllowedByThePowerOfItsError) {
  for (const double ratio : {1.01, 3.0, 1e3, 1e9}) {
    StepLength length(100, 1);
    const double shorter = length.AfterError(LengthStepWith(ratio), 1, 1e-12);
    EXPECT_LT(shorter, 1) << ratio;
    EXPECT_LE(ratio * std::pow(shorter, kLengthPower), 1) << ratio;
    if (ratio > 100) {
      EXPECT_GE(ratio * std::pow(shorter, kLengthPower), 0.1) << ratio;
    }
  }
}

TEST(StepLengthTest, ARepeatedStepIsShorterButNotForNothing) {
  for (const double ratio : {1.0000001, 1e100, kLengthInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    StepLength length(100, 1);
    const double shorter = length.AfterError(LengthStepWith(ratio), 5, 1e-12);
    EXPECT_LE(shorter, 4.5) << ratio;
    EXPECT_GE(shorter, 0.5) << ratio;
  }
}

TEST(StepLengthTest, ALayerIsResolvedAtOnce) {
  StepLength length(100, 1);
  EXPECT_EQ(length.AfterError(LengthStepWith(1e3, 1e-5), 1, 1e-12), 1e-5);
  // But by no step that is not worth it.
  EXPECT_EQ(length.AfterError(LengthStepWith(1e3, 1e-15), 1, 1e-12), 1e-12);
  // A layer that a shorter step resolves anyhow.
  const double shorter = length.AfterError(LengthStepWith(1e3), 1, 1e-12);
  EXPECT_EQ(length.AfterError(LengthStepWith(1e3, 0.9), 1, 1e-12), shorter);
}

TEST(StepLengthTest, LayersThatMayBeRoundingAreResolvedWhereShorterStepsDoNotHelp) {
  const auto second = [](double first_ratio, double second_ratio, bool accepts_between) {
    StepLength length(100, 1);
    const double repeated = length.AfterError(LengthStepWith(first_ratio, kLengthInfinity, 1e-5), 1, 1e-12);
    EXPECT_GT(repeated, 0.05);  // the first time they are not
    EXPECT_EQ(length.Shorten(repeated), 1);
    if (accepts_between) length.Accept(repeated, 0.5);
    return length.AfterError(LengthStepWith(second_ratio, kLengthInfinity, 1e-5), repeated, 1e-12);
  };
  EXPECT_EQ(second(1e3, 1e3, false), 1e-5);
  EXPECT_EQ(second(1e3, 1e4, false), 1e-5);
  EXPECT_GT(second(1e3, 10, false), 1e-3);  // falls
  EXPECT_GT(second(1e3, 1e3, true), 1e-3);  // not in a row
}

TEST(StepLengthTest, CountsWhatIsRepeatedInARow) {
  StepLength length(100, 1);
  EXPECT_EQ(length.Shorten(0.5), 1);
  EXPECT_EQ(length.value(), 0.5);
  EXPECT_EQ(length.Shorten(0.25), 2);
  EXPECT_EQ(length.Shorten(0.125), 3);
  EXPECT_EQ(length.value(), 0.125);
  length.Accept(0.125, 1e-3);
  EXPECT_EQ(length.Shorten(0.1), 1);
  length.EndMode(1);
  EXPECT_EQ(length.Shorten(0.05), 1);
}

TEST(StepLengthTest, StepsBecomeShortWhereModesAccumulate) {
  StepLength length(100, 10);
  length.EndMode(1e-3);  // one short mode alone does not shorten them
  EXPECT_EQ(length.value(), 10);
  for (double lasted = 1e-3; lasted > 1e-9; lasted /= 2) {
    length.EndMode(lasted);
    EXPECT_LE(length.value(), 40 * lasted);
    EXPECT_GE(length.value(), 4 * lasted);
  }
  // Not so where every other mode is long, as in circuits with short pulses.
  StepLength alternates(100, 10);
  for (int k = 0; k < 10; ++k) {
    alternates.EndMode(3);
    alternates.EndMode(1e-6);
  }
  EXPECT_EQ(alternates.value(), 10);
  // What was no mode counts as it lasted.
  StepLength behind_other(100, 10);
  behind_other.EndOther(1e-6);
  behind_other.EndMode(1e-7);
  EXPECT_LE(behind_other.value(), 4e-5);
}

TEST(StepLengthTest, RaisingNeverLowers) {
  StepLength length(100, 1);
  length.RaiseTo(0.5);
  EXPECT_EQ(length.value(), 1);
  length.RaiseTo(7);
  EXPECT_EQ(length.value(), 7);
}

TEST(StepLengthTest, TheShortestStepIsAPartOfTheHorizonOrOfTheFastestTime) {
  const StepLength length(10, 1);
  EXPECT_DOUBLE_EQ(length.ShortestStep(0, nullptr), 1e-12 * 10);
  const Mode slow = LengthModeWith({}, 1e3), none = LengthModeWith({}, 0), fast = LengthModeWith({}, 1e18);
  EXPECT_DOUBLE_EQ(length.ShortestStep(0, &slow), kShortestStep * 10);
  EXPECT_DOUBLE_EQ(length.ShortestStep(0, &none), kShortestStep * 10);
  EXPECT_DOUBLE_EQ(length.ShortestStep(0, &fast), 0.01 * 1e-18);
}

TEST(StepLengthTest, TheShortestStepAndModeMoveTime) {
  const StepLength length(1e3, 1);
  const Mode fast = LengthModeWith({}, 1e30);
  for (const Mode* mode : {static_cast<const Mode*>(nullptr), &fast}) {
    for (double t = 1e-30; t < 1e3; t *= 1.9) {
      const double step = length.ShortestStep(t, mode), lasts = length.ShortestMode(t, mode);
      EXPECT_GT(t + step, t);
      EXPECT_GT(t + lasts, t);
      EXPECT_LE(lasts, step) << t;  // a mode that a step may just cross lasts
    }
  }
}

TEST(StepLengthTest, ModesNearTheStartMayBeShorter) {
  const StepLength length(1, 1);
  EXPECT_NEAR(length.ShortestMode(0, nullptr) / length.ShortestMode(0.1, nullptr), 1e-4, 1e-12);
  double before = 0;
  for (double t = 1e-25; t < 1; t *= 3) {
    const double lasts = length.ShortestMode(t, nullptr);
    EXPECT_GE(lasts, before) << t;
    EXPECT_GT(lasts, 0) << t;
    before = lasts;
  }
}

TEST(StepLengthTest, TheShortestStepAndModeHaveTheUnitOfTime) {
  const double unit = 3e7;
  const StepLength length(2, 1), in_other_units(2 * unit, unit);
  for (const double rate : {0.0, 1.0, 1e13, 1e20}) {
    const Mode mode = LengthModeWith({}, rate), other = LengthModeWith({}, rate / unit);
    for (const double t : {0.0, 1e-20, 1e-12, 1e-5, 1.9}) {
      EXPECT_NEAR(in_other_units.ShortestStep(unit * t, &other) / unit / length.ShortestStep(t, &mode), 1, 1e-12);
      EXPECT_NEAR(in_other_units.ShortestMode(unit * t, &other) / unit / length.ShortestMode(t, &mode), 1, 1e-12);
    }
  }
}

TEST(ShareOfToleranceTest, IsThePartOfTheHorizonButAtLeastTwoPercent) {
  EXPECT_DOUBLE_EQ(ShareOfTolerance(3, 4), 0.75);
  EXPECT_DOUBLE_EQ(ShareOfTolerance(4, 4), 1);
  EXPECT_DOUBLE_EQ(ShareOfTolerance(0.1, 4), 0.025);
  EXPECT_DOUBLE_EQ(ShareOfTolerance(0.04, 4), 0.02);
  EXPECT_DOUBLE_EQ(ShareOfTolerance(1e-9, 4), 0.02);
}

}  // namespace
}  // namespace dlcs
