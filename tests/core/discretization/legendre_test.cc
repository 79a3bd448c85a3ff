// SPDX-License-Identifier: Apache-2.0

#include "core/discretization/legendre.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

LegendreSeries Interpolate(double (*function)(double)) {
  LegendreSeries values(1, kLegendreSize);
  for (Index j = 0; j < kLegendreSize; ++j) values(0, j) = function(GetLegendreBasis().nodes[j]);
  return InterpolateAtNodes(values);
}

TEST(LegendreTest, InterpolatesPolynomialsOfItsDegreeExactly) {
  const LegendreSeries series = Interpolate([](double s) { return 3 * std::pow(s, 12) - std::pow(s, 5) + 2; });
  for (const double s : {-1.0, -0.73, 0.0, 0.2, 0.999, 1.0}) {
    EXPECT_NEAR((series * LegendreValues(s))(0), 3 * std::pow(s, 12) - std::pow(s, 5) + 2, 1e-14);
  }
}

TEST(LegendreTest, ConstantsHaveExactlyOneCoefficient) {
  const LegendreSeries series = Interpolate([](double) { return 0.1; });
  EXPECT_EQ(series(0, 0), 0.1);
  EXPECT_EQ(MaxAbs(series.rightCols(kLegendreDegree)), 0);
}

TEST(LegendreTest, DifferentiatesSeries) {
  const LegendreSeries series = Interpolate([](double s) { return std::pow(s, 7) - s * s; });
  const LegendreSeries slope = DerivativeOf(series);
  for (const double s : {-1.0, -0.4, 0.6, 1.0}) {
    EXPECT_NEAR((slope * LegendreValues(s))(0), 7 * std::pow(s, 6) - 2 * s, 1e-12);
    EXPECT_NEAR(ValueOf(series, LegendreSlopes(LegendreValues(s)))[0], 7 * std::pow(s, 6) - 2 * s, 1e-12);
  }
}

TEST(LegendreTest, BernsteinCoefficientsGiveTheSamePolynomial) {
  const LegendreSeries series = Interpolate([](double s) { return std::exp(2 * s); });
  const LegendreSeries bernstein = series * GetLegendreBasis().to_bernstein;
  for (const double s : {-1.0, -0.4, 0.25, 1.0}) {
    const double t = (1 + s) / 2;
    double sum = 0;
    double binomial = 1;
    for (Index j = 0; j < kLegendreSize; ++j) {
      const auto k = static_cast<double>(j);
      sum += bernstein(0, j) * binomial * std::pow(t, k) * std::pow(1 - t, kLegendreDegree - k);
      binomial *= (kLegendreDegree - k) / (k + 1);
    }
    EXPECT_NEAR(sum, (series * LegendreValues(s))(0), 1e-12);
  }
}

// Of smooth functions the estimate is an upper bound, and no more than a thousand times too large; of a kink
// it is one.
TEST(LegendreTest, TailBoundsTheErrorOfInterpolation) {
  const auto largest_error = [](const LegendreSeries& series, double (*function)(double)) {
    double error = 0;
    for (int i = 0; i <= 400; ++i) {
      const double s = i / 200.0 - 1;
      error = std::max(error, std::abs((series * LegendreValues(s))(0) - function(s)));
    }
    return error;
  };
  for (double (*function)(double) :
       {+[](double s) { return std::sin(3 * s + 0.4); }, +[](double s) { return std::exp(2.5 * s); },
        +[](double s) { return 1 / (2 + s); }}) {
    const LegendreSeries series = Interpolate(function);
    const double error = largest_error(series, function);
    EXPECT_LT(error, EstimateTail(series)[0]);
    EXPECT_GT(error, 1e-3 * EstimateTail(series)[0]);
  }
  double (*kink)(double) = [](double s) { return std::abs(s - 0.3); };
  const LegendreSeries series = Interpolate(kink);
  EXPECT_LT(largest_error(series, kink), EstimateTail(series)[0]);
}

}  // namespace
}  // namespace dlcs
