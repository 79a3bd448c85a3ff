// SPDX-License-Identifier: Apache-2.0
// Turning points against closed forms.
#include "core/outputs/monotone_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace dlcs {
namespace {

LegendreSeries SeriesOf(const std::vector<std::function<double(double)>>& functions) {
  LegendreSeries values(static_cast<Index>(functions.size()), kLegendreSize);
  for (Index i = 0; i < values.rows(); ++i) {
    for (Index j = 0; j < kLegendreSize; ++j) {
      values(i, j) = functions[static_cast<std::size_t>(i)](GetLegendreBasis().nodes[j]);
    }
  }
  return InterpolateAtNodes(values);
}

double DistanceTo(double s, const std::vector<double>& cuts) {
  double distance = HUGE_VAL;
  for (const double cut : cuts) distance = std::min(distance, std::abs(cut - s));
  return distance;
}

TEST(MonotonePartsTest, AMonotoneProductIsOnePart) {
  const std::vector<double> whole = {-1, 1};
  EXPECT_EQ(MonotoneParts(SeriesOf({[](double) { return 0.3; }})), whole);
  EXPECT_EQ(MonotoneParts(SeriesOf({[](double s) { return 2 - s; }})), whole);
  EXPECT_EQ(MonotoneParts(SeriesOf({[](double s) { return 2 + s; }, [](double s) { return 3 + s; }})), whole);
  EXPECT_EQ(MonotoneParts(LegendreSeries::Constant(1, kLegendreSize, std::numeric_limits<double>::infinity())), whole);
}

// (s - a)² turns at a, (s - a)³/3 - d² (s - a) at a ± d.
TEST(MonotonePartsTest, FindsTurningPointsHoweverCloseTogether) {
  for (const double a : {-0.85, -0.5, 0.0, 0.123456, 0.995}) {
    const auto cuts = MonotoneParts(SeriesOf({[a](double s) { return (s - a) * (s - a); }}));
    EXPECT_LT(DistanceTo(a, cuts), 1e-13) << a;
    EXPECT_LE(cuts.size(), 3U);
    for (const double d : {0.1, 1e-2, 1e-3}) {
      const auto both =
          MonotoneParts(SeriesOf({[a, d](double s) { return std::pow(s - a, 3) / 3 - d * d * (s - a); }}));
      EXPECT_LT(DistanceTo(a - d, both), 1e-13 / d) << a << " " << d;
      if (a + d < 1) {
        EXPECT_LT(DistanceTo(a + d, both), 1e-13 / d) << a << " " << d;
      }
    }
  }
}

// s (s² - 1) turns at ±1/√3, and (s - 1/2)² (s + 1/2)² at ±1/2 and 0.
TEST(MonotonePartsTest, FindsTurningPointsOfProducts) {
  const auto cubic = MonotoneParts(SeriesOf({[](double s) { return s * s - 1; }, [](double s) { return s; }}));
  for (const double s : {-1 / std::sqrt(3), 1 / std::sqrt(3)}) EXPECT_LT(DistanceTo(s, cubic), 1e-13);
  const auto shifted = [](double by) { return [by](double s) { return s - by; }; };
  const auto quartic = MonotoneParts(SeriesOf({shifted(0.5), shifted(0.5), shifted(-0.5), shifted(-0.5)}));
  for (const double s : {-0.5, 0.0, 0.5}) EXPECT_LT(DistanceTo(s, quartic), 1e-13);
}

// s³ - s turns at ±0.577, to ±0.385.
TEST(MonotonePartsTest, LeavesOutWhatLiesOutsideOfTheRange) {
  const LegendreSeries series = SeriesOf({[](double s) { return s * s * s - s; }});
  EXPECT_EQ(MonotoneParts(series, {.low = 1}).size(), 2U);
  EXPECT_EQ(MonotoneParts(series, {.high = -1}).size(), 2U);
  const auto upper = MonotoneParts(series, {.low = 0.3});
  EXPECT_LT(DistanceTo(-1 / std::sqrt(3), upper), 1e-13);
  EXPECT_GT(DistanceTo(1 / std::sqrt(3), upper), 0.1);
}

}  // namespace
}  // namespace dlcs
