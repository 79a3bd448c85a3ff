// SPDX-License-Identifier: Apache-2.0
// Remark 2.4 of [Wu & Chen]: contours for wide sectors, by measured errors.

#include "core/laplace/contour_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace dlcs {
namespace {

using Complex = std::complex<double>;

// The error of the source term of x' = λ x + 1 at t = 1, (e^λ - 1)/λ, largest over λ in the sector, 1e-3 <= |λ| <= 1e6.
double LargestError(const Contour& contour, double sector_angle) {
  double largest = 0;
  for (int k = 0; k < 60; ++k) {
    for (const double angle : {0.0, sector_angle / 2, sector_angle}) {
      const Complex lambda = -std::polar(std::pow(10, -3 + 9.0 * k / 59), angle);
      const auto term = [&](Complex z, Complex weight) { return weight * (std::exp(z) - 1.0) / z / (z - lambda); };
      Complex sum = -(std::exp(lambda) - 1.0) / lambda;
      for (const ContourNode& node : Nodes(contour)) {
        // The weights are doubled for real data; here λ stands alone.
        const bool real = node.z.imag() == 0;
        sum += term(node.z, real ? node.weight : node.weight / 2.0);
        if (!real) sum += term(std::conj(node.z), std::conj(node.weight) / 2.0);
      }
      largest = std::max(largest, std::abs(sum));
    }
  }
  return largest;
}

class ContourChoiceTest : public ::testing::TestWithParam<double> {};

TEST_P(ContourChoiceTest, ConvergesAtTheRateOfItsSector) {
  const double alpha = GetParam();
  const auto error = [&](Index nodes) { return LargestError(BestSourceContour(nodes, alpha), alpha); };
  const double rate = std::sqrt(std::numbers::pi * (std::numbers::pi / 2 - alpha));
  // √P grows by 10 from P = 100 to 400; the rate is reached from below, the error is above rounding for all α >= 0.3.
  const double measured = std::log(error(100) / error(alpha < 1 ? 196 : 400)) / (alpha < 1 ? 4 : 10);
  EXPECT_GT(measured, 0.85 * rate);
  EXPECT_LT(measured, 1.25 * rate);
  for (const Index nodes : {16, 25, 64, 100}) {
    const double predicted = std::exp(LogSourceError(BestSourceContour(nodes, alpha), alpha));
    EXPECT_LT(error(nodes), 3 * predicted) << nodes;
  }
}

INSTANTIATE_TEST_SUITE_P(Sectors, ContourChoiceTest, ::testing::Values(0.3, 0.5, 0.7, 0.8, 1.0, 1.2, 1.4, 1.5));

// The rate 2.06 of Theorem 2.2 holds near α = 0 only: the contour comes close to a wide sector before α reaches
// π/2 - γ, and beyond it does not converge.
TEST(ContourChoiceTest, BeatsTheContourOfTheoremTwoTwoForWideSectors) {
  EXPECT_LT(LargestError(SourceContour(100), 0.0), std::exp(-2.06 * 10));
  EXPECT_GT(LargestError(SourceContour(100), 0.7), 1e-4);
  EXPECT_LT(LargestError(BestSourceContour(100, 0.7), 0.7), 1e-6);
  EXPECT_GT(LargestError(SourceContour(100), 1.0), 1e-2);
  EXPECT_LT(LargestError(BestSourceContour(100, 1.0), 1.0), 1e-5);
}

TEST(ContourChoiceTest, TakesTheoremTwoTwoWhereItAppliesAndWhatIsGivenAlways) {
  Options options;
  EXPECT_EQ(ContourFor(options, 0.5).gamma, 0.794);
  EXPECT_LT(ContourFor(options, 0.8).gamma + 0.8, std::numbers::pi / 2);
  EXPECT_LT(ContourFor(options, 1.2).gamma + 1.2, std::numbers::pi / 2);
  EXPECT_EQ(ContourFor(options, 1.5).gamma, 0.794);
  options.contour_gamma = 0.2;
  EXPECT_EQ(ContourFor(options, 1.0).gamma, 0.2);
}

}  // namespace
}  // namespace dlcs
