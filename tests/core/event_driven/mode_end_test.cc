// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode_end.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace dlcs {
namespace {

using Guards = std::vector<std::function<double(double)>>;

LegendreSeries EndSeriesOf(const Guards& guards) {
  LegendreSeries values(static_cast<Index>(guards.size()), kLegendreSize);
  for (Index i = 0; i < values.rows(); ++i) {
    for (Index j = 0; j < kLegendreSize; ++j) {
      values(i, j) = guards[static_cast<std::size_t>(i)](GetLegendreBasis().nodes[j]);
    }
  }
  return InterpolateAtNodes(values);
}

// A step of which nothing is known but its guards, without errors.
SmoothStep EndStepOf(const Guards& guards, double level) {
  const auto n = static_cast<Index>(guards.size());
  SmoothStep step;
  step.guard.values = EndSeriesOf(guards);
  step.guard.error.truncation = step.guard.tail = step.guard.error.rounding = Vector::Zero(n);
  step.guard_level = Vector::Constant(n, level);
  step.guard_allowed = Vector::Zero(n);
  return step;
}

TEST(FindModeEndTest, IsTheZeroOfTheGuardThatFallsFirst) {
  const SmoothStep step =
      EndStepOf({[](double s) { return std::exp(0.6) - std::exp(s); }, [](double s) { return 0.25 - s; },
                 [](double) { return 1.0; }, [](double s) { return (s - 0.1) * (s - 0.1); }},
                1e-5);
  const std::optional<ModeEnd> end = FindModeEnd(step);
  ASSERT_TRUE(end);
  EXPECT_EQ(end->guard, 1);
  EXPECT_NEAR(end->s, 0.25, 1e-12);  // not where the level is, 1e-5 later
}

TEST(FindModeEndTest, IsNoneWhereGuardsStayAboveTheirLevels) {
  const Guards guards = {[](double) { return 0.0; }, [](double s) { return 1 + s; },
                         [](double s) { return (s - 0.3) * (s - 0.3) - 1e-4; }, [](double s) { return 1 - s; }};
  EXPECT_FALSE(FindModeEnd(EndStepOf(guards, 1.1e-4)));
  const std::optional<ModeEnd> end = FindModeEnd(EndStepOf(guards, 0.9e-4));
  ASSERT_TRUE(end);
  EXPECT_EQ(end->guard, 2);
  EXPECT_NEAR(end->s, 0.3 - 1e-2, 3e-3);  // between the zero and the bottom of the dip
  EXPECT_FALSE(FindModeEnd(EndStepOf({}, 1e-9)));
}

TEST(FindModeEndTest, IsWhereTheLevelIsIfNoZeroIsBefore) {
  const double level = 1e-3;
  // Starts below zero.
  const std::optional<ModeEnd> end = FindModeEnd(EndStepOf({[=](double s) { return -level / 2 - (1 + s); }}, level));
  ASSERT_TRUE(end);
  EXPECT_NEAR(end->s, -1 + level / 2, 1e-12);
  // Starts below its level.
  const std::optional<ModeEnd> at_once = FindModeEnd(EndStepOf({[](double s) { return s; }}, level));
  ASSERT_TRUE(at_once);
  EXPECT_EQ(at_once->s, -1);
}

TEST(FindModeEndTest, HasNoUnitsAndNoOrderOfGuards) {
  const Guards guards = {[](double s) { return std::cos(2 * s + 0.5) + 0.3; }, [](double s) { return 0.5 - s; }};
  SmoothStep step = EndStepOf(guards, 1e-9);
  const std::optional<ModeEnd> end = FindModeEnd(step);
  ASSERT_TRUE(end);
  EXPECT_EQ(end->guard, 1);
  const Vector units{{1e-90, 3e80}};
  step.guard.values = units.asDiagonal() * step.guard.values;
  step.guard_level = units.cwiseProduct(step.guard_level);
  const std::optional<ModeEnd> in_units = FindModeEnd(step);
  ASSERT_TRUE(in_units);
  EXPECT_EQ(in_units->guard, 1);
  EXPECT_NEAR(in_units->s, end->s, 1e-13);
  const std::optional<ModeEnd> swapped = FindModeEnd(EndStepOf({guards[1], guards[0]}, 1e-9));
  ASSERT_TRUE(swapped);
  EXPECT_EQ(swapped->guard, 0);
  EXPECT_EQ(swapped->s, end->s);
}

// Against dense sampling: no guard is below its level before the end, and at the end one is zero and falls below it.
TEST(FindModeEndTest, MissesNothingOnRandomGuards) {
  std::mt19937_64 engine(11);
  std::normal_distribution<double> normal;
  int ends = 0;
  for (int trial = 0; trial < 300; ++trial) {
    SmoothStep step = EndStepOf(Guards(3, [](double) { return 1.0; }), 1e-6);
    for (Index k = 0; k < kLegendreSize; ++k) {
      for (Index i = 0; i < 3; ++i)
        step.guard.values(i, k) += 0.5 * normal(engine) * std::pow(0.7, static_cast<double>(k));
    }
    const std::optional<ModeEnd> end = FindModeEnd(step);
    ends += end.has_value();
    for (int j = 0; j <= 400; ++j) {
      const double s = -1 + j / 200.0;
      if (end && s >= end->s) break;
      ASSERT_GE((step.guard.values * LegendreValues(s)).minCoeff(), -1.001e-6) << trial << " at " << s;
    }
    if (!end) continue;
    const auto guard = step.guard.values.row(end->guard);
    const double value = guard.dot(LegendreValues(end->s));
    EXPECT_TRUE(end->s == -1 || std::abs(value) <= 1.001e-6) << trial << ": " << value;
    double lowest = value;
    for (int j = 0; j <= 1000; ++j) {
      lowest = std::min(lowest, guard.dot(LegendreValues(std::min(1.0, end->s + 1e-4 * j))));
    }
    EXPECT_LE(lowest, -0.999e-6) << trial;
  }
  EXPECT_GT(ends, 100);
  EXPECT_LT(ends, 295);
}

TEST(FallsFromZeroTest, IsTrueWhereOnlyTheLevelKeepsTheModeAlive) {
  const double level = 1e-6;
  const auto falls = [&](const std::function<double(double)>& guard) {
    const SmoothStep step = EndStepOf({guard}, level);
    const std::optional<ModeEnd> end = FindModeEnd(step);
    EXPECT_TRUE(end);
    return end && FallsFromZero(step, *end);
  };
  EXPECT_TRUE(falls([&](double s) { return -level / 100 - (1 + s); }));
  EXPECT_TRUE(falls([&](double s) { return -level / 100 - 1e-3 * std::expm1(1 + s); }));
  EXPECT_FALSE(falls([](double s) { return -s; }));
  EXPECT_FALSE(falls([&](double s) { return 100 * level - (1 + s); }));
  EXPECT_FALSE(falls([](double s) { return (1 + s) * (0.5 - s); }));  // rises from zero first
  EXPECT_FALSE(falls([&](double s) { return -level / 100 + (1 + s) * (0.5 - s); }));
}

TEST(StartsBelowTest, ByNoMoreThanTheErrorOfThePolynomial) {
  SmoothStep step = EndStepOf(
      {[](double) { return 5.0; }, [](double s) { return -1e-4 + (1 + s); }, [](double s) { return -s; }}, 1e-6);
  step.guard.tail = Vector::Constant(3, 1e-4);
  EXPECT_FALSE(StartsBelowByTruncation(step, 0));
  EXPECT_TRUE(StartsBelowByTruncation(step, 1));
  EXPECT_FALSE(StartsBelowByTruncation(step, 2));  // starts at 1
  // By more than an error may explain.
  step.guard.tail[1] = 1e-6;
  EXPECT_FALSE(StartsBelowByTruncation(step, 1));
  // Rounding is no smaller on a shorter step.
  step.guard.tail[1] = 1e-4;
  step.guard.error.rounding[1] = 1e-4;
  EXPECT_FALSE(StartsBelowByTruncation(step, 1));
}

TEST(StartsBelowTest, GuardsThatRiseAtOnceMayStartBelowByWhatIsAllowed) {
  const double level = 1e-9;
  SmoothStep step = EndStepOf({
                                  [](double s) { return -1e-3 + (1 + s); },            // by what is allowed
                                  [=](double s) { return -50 * level + (1 + s); },     // by less than 64 levels
                                  [=](double s) { return -70 * level + (1 + s); },     // by more
                                  [](double s) { return -1e-3 - (1 + s); },            // falls
                                  [](double s) { return 1 + s; },                      // no need
                                  [](double s) { return -3e-3 + (1 + s) * (1 + s); },  // more than is allowed
                              },
                              level);
  step.guard_allowed = Vector{{2e-3, 0, 0, 2e-3, 2e-3, 2e-3}};
  LetRisingGuardsStartBelow(step);
  const auto ends = [&](Index guard) {
    SmoothStep one;
    one.guard.values = step.guard.values.row(guard);
    one.guard_level = step.guard_level.segment(guard, 1);
    return FindModeEnd(one).has_value();
  };
  EXPECT_FALSE(ends(0));
  EXPECT_FALSE(ends(1));
  for (const Index i : {2, 3, 5}) EXPECT_TRUE(ends(i)) << i;
  for (const Index i : {2, 3, 4, 5}) EXPECT_EQ(step.guard_level[i], level) << i;
  // A level is never lowered.
  step.guard_level[0] = 1;
  LetRisingGuardsStartBelow(step);
  EXPECT_EQ(step.guard_level[0], 1);
}

LegendreVector EndRowOf(const std::function<double(double)>& guard) { return EndSeriesOf({guard}).transpose(); }

// Where w stays zero, p = -noise e^(rate t). Rounding grows to the size of numbers: by 1e16 or so.
TEST(RepelledStartsTest, FollowsTheGrowthOfRoundingOverSteps) {
  const LegendreVector zero = EndRowOf([](double) { return 0.0; });
  RepelledStarts in_one(1);
  const double grown = in_one.Follow(0, zero, 100, 1e-3, 1);
  EXPECT_GT(grown, 1e-3 * 1e15);
  EXPECT_LT(grown, 1e-3 * 1e19);
  RepelledStarts starts(2);
  double over_steps = 0;
  int steps = 0;
  while (over_steps == 0 && steps < 100) {
    over_steps = starts.Follow(1, zero, 3, steps == 0 ? 1e-3 : 77, 0);  // noise counts at the begin only
    ++steps;
    EXPECT_EQ(starts.MayBe(1, EndRowOf([](double) { return 1e9; }), 0), over_steps == 0);
  }
  EXPECT_GT(steps, 11);  // a time of 3/rate each: e^(3 · 12) is 4e15
  EXPECT_LT(steps, 16);
  EXPECT_NEAR(std::log(over_steps / grown), 0, 0.3);
  EXPECT_FALSE(starts.MayBe(0, EndRowOf([](double) { return 1.0; }), 0.5));  // another pair
}

// w = a (1 + s): p = (a/r - noise) e^(r t) - a/r, which returns to zero if noise < a/r.
TEST(RepelledStartsTest, FollowsAGuardThatRises) {
  constexpr double kRate = 25, kRise = 5;
  const LegendreVector rises = EndRowOf([](double s) { return kRise * (1 + s); });
  RepelledStarts starts(1);
  EXPECT_EQ(starts.Follow(0, rises, kRate, 0.19, 1), 0);
  EXPECT_FALSE(starts.MayBe(0, EndRowOf([](double) { return 1.0; }), 0.5));  // it is over
  const double grown = starts.Follow(0, rises, kRate, 0.21, 1);
  const double of_one = starts.Follow(0, EndRowOf([](double) { return 0.0; }), kRate, 1, 1);
  EXPECT_NEAR(grown / (0.01 * of_one), 1, 1e-6);  // that of a noise of 0.21 - a/r
  EXPECT_GT(grown, 1e13);
}

TEST(RepelledStartsTest, StartsWhereWIsZeroToItsNoise) {
  RepelledStarts starts(1);
  const LegendreVector w = EndRowOf([](double s) { return 1e-3 + (1 + s); });
  EXPECT_TRUE(starts.MayBe(0, w, 2e-3));
  EXPECT_FALSE(starts.MayBe(0, w, 0.5e-3));
  EXPECT_EQ(starts.Follow(0, EndRowOf([](double) { return 0.0; }), 1, 1, 1), 0);
  EXPECT_TRUE(starts.MayBe(0, w, 0.5e-3));  // followed now
  starts.End(0);
  EXPECT_FALSE(starts.MayBe(0, w, 0.5e-3));
}

// x1' = -x1 + 0.5 y, x2' = -x2 - 3 y, w = 0.2 x1 + g + M y, in the mode of `active`, with the guard given.
class OverlookedTest : public ::testing::Test {
 protected:
  void Make(double M, std::vector<Index> active) {
    problem_.A = -Matrix::Identity(2, 2);
    problem_.B = Vector{{0.5, -3}};
    problem_.N = Vector{{0.2, 0}}.transpose();
    problem_.M = Matrix::Constant(1, 1, M);
    problem_.horizon = 1;
    mode_ = ModeMaker(problem_).Make(std::move(active), {Vector::Ones(2), Vector::Ones(2), Vector::Ones(1)});
    ASSERT_TRUE(mode_);
    stepper_ = std::make_shared<const ModeStepper>(*mode_, kDuration);
  }
  SmoothStep StepOf(const std::function<double(double)>& guard, double noise = 0) const {
    SmoothStep step = EndStepOf({guard}, 1);
    step.stepper = stepper_;
    step.guard.error.rounding[0] = noise;
    return step;
  }
  OverlookedByCause Of(const SmoothStep& step, double s_end = 1, double of_truncation = 0,
                       double of_rounding = 0) const {
    RepelledStarts repelled(1);
    return OverlookedEvents(problem_, step, {Vector::Constant(1, of_truncation), Vector::Constant(1, of_rounding)},
                            Magnitudes(problem_, {}, 1), s_end, kDuration, 1e-9, repelled);
  }
  static bool IsNothing(const Overlooked& of) { return of.slope.isZero(0) && of.x.isZero(0) && of.y.isZero(0); }
  static void ExpectNear(const Vector& found, const Vector& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (Index i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 0.25 * std::abs(expected[i])) << i;
  }

  static constexpr double kDuration = 0.3;
  Problem problem_;
  std::unique_ptr<Mode> mode_;
  std::shared_ptr<const ModeStepper> stepper_;
};

// (s - 0.1)² - d² has a dip of d², and the mean 2 d³/3 over the step.
constexpr double kDip = 1e-2;
double DipOfGuard(double s) { return (s - 0.1) * (s - 0.1) - kDip * kDip; }
constexpr double kDipDepth = kDip * kDip, kDipMean = 2 * kDip * kDip * kDip / 3;

TEST_F(OverlookedTest, ANegativeWMissedItsY) {
  Make(4, {});
  const OverlookedByCause found = Of(StepOf(DipOfGuard));
  ExpectNear(found.truncation.slope, kDipMean / 4 * Vector{{0.5, 3}});
  ExpectNear(found.with_signs.slope, kDipMean / 4 * Vector{{0.5, -3}});
  ExpectNear(found.truncation.y, Vector{{kDipDepth / 4}});
  EXPECT_TRUE(found.truncation.x.isZero(0));
  EXPECT_TRUE(IsNothing(found.rounding));
}

TEST_F(OverlookedTest, ANegativeYShouldBeZero) {
  Make(4, {0});
  const OverlookedByCause found = Of(StepOf(DipOfGuard));
  ExpectNear(found.truncation.slope, kDipMean * Vector{{0.5, 3}});
  ExpectNear(found.with_signs.slope, kDipMean * Vector{{0.5, -3}});
  EXPECT_TRUE(IsNothing(found.rounding));
}

TEST_F(OverlookedTest, AYWithoutMKeepsXOnTheConstraint) {
  Make(0, {});
  const OverlookedByCause found = Of(StepOf(DipOfGuard));
  // The error of x makes w positive: N B = 0.1 by one of y.
  ExpectNear(found.truncation.x, kDipDepth / 0.1 * Vector{{0.5, 3}});
  ExpectNear(found.with_signs.x, kDipDepth / 0.1 * Vector{{0.5, -3}});
}

TEST_F(OverlookedTest, OnlyWhatIsBeforeTheEndCounts) {
  Make(4, {});
  const SmoothStep step = StepOf(DipOfGuard);
  EXPECT_TRUE(IsNothing(Of(step, 0.05).truncation));
  EXPECT_FALSE(IsNothing(Of(step, 0.2).truncation));
}

TEST_F(OverlookedTest, WhatComesNoNearerToZeroThanItsErrorIsNothing) {
  Make(4, {});
  const SmoothStep step = StepOf([](double s) { return 1e-2 + (s - 0.1) * (s - 0.1); });
  for (const OverlookedByCause& found : {Of(step), Of(step, 1, 0.9e-2), Of(step, 1, 0, 0.9e-2)}) {
    EXPECT_TRUE(IsNothing(found.truncation));
    EXPECT_TRUE(IsNothing(found.with_signs));
    EXPECT_TRUE(IsNothing(found.rounding));
  }
}

TEST_F(OverlookedTest, WhatComesNearerCountsAsItsCause) {
  Make(4, {});
  SmoothStep step = StepOf([](double s) { return 1e-2 + (s - 0.1) * (s - 0.1); });
  const OverlookedByCause by_truncation = Of(step, 1, 1.4e-2), by_rounding = Of(step, 1, 0, 1.4e-2);
  ExpectNear(by_truncation.truncation.y, Vector{{0.4e-2 / 4}});
  EXPECT_TRUE(IsNothing(by_truncation.rounding));
  ExpectNear(by_rounding.rounding.y, Vector{{0.4e-2 / 4}});
  EXPECT_TRUE(IsNothing(by_rounding.truncation));
  step.guard.error.truncation[0] = 1.4e-2;  // that of the guard itself
  ExpectNear(Of(step).truncation.y, Vector{{0.4e-2 / 4}});
}

}  // namespace
}  // namespace dlcs
