// SPDX-License-Identifier: Apache-2.0
// Remark 2.1 of [Wu & Chen]: why circles do not do, and the splitting that does.

#include "core/laplace/spectrum_split.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/laplace/contour.h"
#include "core/linalg/norms.h"
#include "core/linalg/phi_functions.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;
using Complex = std::complex<double>;

// 1/(2πi) ∫ e^{zt}/(z - λ) dz over the hyperbola of Remark 2.3 for time t, both halves, and over the circle of
// radius `radius` round λ: the two integrals of (2.3) for A = λ, x0 = 1 and no source.
Complex OverHyperbola(Complex lambda, double t) {
  Complex sum = 0;
  for (const ContourNode& node : Nodes(InitialStateContour(13))) {
    const auto term = [&](Complex z, Complex weight) { return weight / t * std::exp(z) / (z / t - lambda); };
    const bool real = node.z.imag() == 0;
    sum += term(node.z, real ? node.weight : node.weight / 2.0);
    if (!real) sum += term(std::conj(node.z), std::conj(node.weight) / 2.0);
  }
  return sum;
}
Complex OverCircle(Complex lambda, double t, double radius) {
  constexpr double kNodes = 64;
  Complex sum = 0;
  for (int k = 0; k < kNodes; ++k) {
    const Complex offset = std::polar(radius, 2 * std::numbers::pi * k / kNodes);
    sum += std::exp((lambda + offset) * t) / kNodes;  // dz/(z - λ) = i dθ
  }
  return sum;
}

// While t is small, the hyperbola (μ/t)(...) encloses λ, whatever λ is: alone it is right, and with the circle it
// has e^{λt} twice, a relative error of one. Once t is large it has left λ behind: then the circle is needed.
TEST(Remark21Test, CirclesCountEigenvaluesTwiceForSmallTimes) {
  for (const Complex lambda : {Complex(1, 0), Complex(0, 2), Complex(0.3, 1)}) {
    const auto errors = [&](double t) {
      const Complex exact = std::exp(lambda * t), alone = OverHyperbola(lambda, t);
      return std::pair(std::abs(alone - exact) / std::abs(exact),
                       std::abs(alone + OverCircle(lambda, t, std::min(0.1, 1 / t)) - exact) / std::abs(exact));
    };
    const auto [alone_small, both_small] = errors(0.01);
    EXPECT_LT(alone_small, 1e-8);
    EXPECT_NEAR(both_small, 1, 1e-8);
    const auto [alone_large, both_large] = errors(400);
    EXPECT_NEAR(alone_large, 1, 1e-6);
    EXPECT_LT(both_large, 1e-6);
  }
  // Zero is inside for every t and needs no circle.
  for (const double t : {1e-3, 1.0, 1e3}) EXPECT_LT(std::abs(OverHyperbola(0, t) - 1.0), 1e-10);
}

// e^{tA} from its two parts: that of the resolvent by partial fractions, as T is upper triangular and small.
TEST(SpectrumSplitTest, TakesEveryEigenvalueOnce) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Index m = 2 + seed % 9;
    const Matrix A = RandomMatrix(m, m, seed);
    const auto is_outside = [](Complex lambda) { return std::abs(std::arg(-lambda)) > 0.9; };
    const SpectrumSplit split = SplitSpectrum(A, is_outside);
    if (split.condition > kWorstCondition) continue;
    const Index k = split.separated();
    EXPECT_EQ(split.inside.T().rows(), m - k);
    for (const Complex& lambda : split.inside.Eigenvalues()) EXPECT_FALSE(is_outside(lambda)) << seed;
    for (const Complex& lambda : Resolvent(split.outside).Eigenvalues()) EXPECT_TRUE(is_outside(lambda)) << seed;
    const double size = split.condition * split.condition * 1e-13;
    EXPECT_LT(MaxAbs(split.left * split.basis - Matrix::Identity(k, k)), size) << seed;
    EXPECT_LT(MaxAbs(A * split.basis - split.basis * split.outside), size) << seed;
    EXPECT_LT(MaxAbs(split.left * A - split.outside * split.left), size) << seed;
    // (zI - A)⁻¹ is the sum of both parts, at any z.
    const Complex z(0.7, 1.3);
    const Eigen::MatrixXcd whole = (z * Eigen::MatrixXcd::Identity(m, m) - A.cast<Complex>()).inverse();
    const Eigen::MatrixXcd outside = (z * Eigen::MatrixXcd::Identity(k, k) - split.outside.cast<Complex>()).inverse();
    EXPECT_LT((split.inside.Inverse(z) + split.basis * outside * split.left - whole).norm(), size * whole.norm())
        << seed;
  }
}

TEST(SpectrumSplitTest, LeavesAllOutsideWhereEigenvaluesAreTooCloseToSeparate) {
  Matrix A(2, 2);
  A << 0.5, 1, 0, 0.5 + 1e-6;
  const SpectrumSplit split = SplitSpectrum(A, [](Complex lambda) { return lambda.real() > 0.5 + 5e-7; });
  EXPECT_EQ(split.separated(), 2);
  EXPECT_GT(split.condition, kWorstCondition);
}

}  // namespace
}  // namespace dlcs
