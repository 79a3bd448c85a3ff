// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/first_crossing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace dlcs {
namespace {

LegendreVector Interpolate(const std::function<double(double)>& function) {
  LegendreSeries values(1, kLegendreSize);
  for (Index j = 0; j < kLegendreSize; ++j) values(0, j) = function(GetLegendreBasis().nodes[j]);
  return InterpolateAtNodes(values).transpose();
}

TEST(FirstCrossingTest, FindsTheFirstOfSeveralRoots) {
  // From positive to negative at -0.5, back at 0.2, again at 0.7.
  const auto crossing = FirstCrossing(Interpolate([](double s) { return -(s + 0.5) * (s - 0.2) * (s - 0.7); }), 0);
  ASSERT_TRUE(crossing.has_value());
  EXPECT_NEAR(*crossing, -0.5, 1e-14);
}

TEST(FirstCrossingTest, LocatesSimpleRootsToRounding) {
  for (int k = -9; k <= 9; ++k) {
    const double root = k / 10.0;
    const auto crossing = FirstCrossing(Interpolate([&](double s) { return std::exp(root) - std::exp(s); }), 0);
    ASSERT_TRUE(crossing.has_value());
    EXPECT_NEAR(*crossing, root, 1e-11);  // the degree resolves e^s to 1e-12
  }
}

TEST(FirstCrossingTest, TouchingIsNoCrossingAndDippingIs) {
  const auto touching = Interpolate([](double s) { return (s - 0.3) * (s - 0.3); });
  EXPECT_FALSE(FirstCrossing(touching, 1e-15).has_value());
  const auto dip = FirstCrossing(touching, -1e-8);
  ASSERT_TRUE(dip.has_value());
  EXPECT_NEAR(*dip, 0.3 - 1e-4, 1e-9);
}

TEST(FirstCrossingTest, NegativeAtTheStartIsACrossingThere) {
  EXPECT_EQ(FirstCrossing(Interpolate([](double s) { return s + 0.9; }), 0), -1);
  EXPECT_FALSE(FirstCrossing(Interpolate([](double s) { return s + 1; }), 1e-15).has_value());
}

TEST(FirstCrossingTest, LooksOnlyBeforeTheGivenPosition) {
  const auto series = Interpolate([](double s) { return 0.5 - s; });
  EXPECT_TRUE(FirstCrossing(series, 0).has_value());
  EXPECT_FALSE(FirstCrossing(series, 0, -0.9).has_value());
}

// Random polynomials, dense sampling: nothing negative lies before the crossing, and something does right
// behind it.
TEST(FirstCrossingTest, MissesNothingOnRandomPolynomials) {
  std::mt19937_64 engine(7);
  std::normal_distribution<double> normal;
  int crossings = 0;
  for (int trial = 0; trial < 600; ++trial) {
    LegendreVector series;
    for (Index k = 0; k < kLegendreSize; ++k) series[k] = normal(engine) * std::pow(0.7, static_cast<double>(k));
    series[0] += 1;
    const auto crossing = FirstCrossing(series, 0);
    const double before = crossing.value_or(1.0);
    for (int i = 0; i <= 250; ++i) {
      const double s = -1 + i / 125.0;
      if (s < before - 1e-12) {
        ASSERT_GT(series.dot(LegendreValues(s)), -1e-13) << "trial " << trial << " at " << s;
      }
    }
    if (!crossing) continue;
    ++crossings;
    const double behind = series.dot(LegendreValues(std::min(1.0, *crossing + 1e-9)));
    EXPECT_TRUE(behind < 1e-13) << "trial " << trial;
  }
  EXPECT_GT(crossings, 150);
}

TEST(DipBelowZeroTest, MeasuresDipsThatLieBetweenTheNodes) {
  // (s - 0.3)² - d² is below zero for 2 d, down to d²; its integral there is 4 d³/3.
  for (const double d : {1e-1, 1e-3, 1e-5}) {
    const auto series = Interpolate([](double s) { return (s - 0.3) * (s - 0.3); });
    const Dip dip = DipBelowZero(series, -d * d, 1);
    EXPECT_NEAR(dip.depth, d * d, 0.1 * d * d);
    EXPECT_NEAR(dip.mean, 2 * d * d * d / 3, 0.2 * d * d * d) << d;
  }
}

TEST(DipBelowZeroTest, CountsOnlyWhatIsBeforeTheEnd) {
  const auto series = Interpolate([](double s) { return 0.5 - s; });
  EXPECT_EQ(DipBelowZero(series, 0, 0.4).depth, 0);
  EXPECT_EQ(DipBelowZero(series, 0, 0.4).mean, 0);
  const Dip dip = DipBelowZero(series, 0, 1);
  EXPECT_NEAR(dip.depth, 0.5, 0.05);
  EXPECT_NEAR(dip.mean, 0.0625, 0.00625);
}

TEST(LowestMinimumTest, FindsTheLowestInsideTheInterval) {
  // Two minima, at sin(4 s) = 0.025; the left one is lower.
  const auto series = Interpolate([](double s) { return std::cos(4 * s) + 0.1 * s; });
  const double s = -(std::numbers::pi + std::asin(0.025)) / 4;
  const auto lowest = LowestMinimum(series, 1);
  ASSERT_TRUE(lowest.has_value());
  EXPECT_NEAR(lowest->value, std::cos(4 * s) + 0.1 * s, 1e-6);
  EXPECT_NEAR(lowest->curvature, -16 * std::cos(4 * s), 0.01);
  EXPECT_FALSE(LowestMinimum(series, -0.85).has_value());
}

}  // namespace
}  // namespace dlcs
