// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/band_matrix.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/lcp/structured/band_factor.h"
#include "core/linalg/norms.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

// t_d = 2^-d with the reflections of fixed ends.
Matrix Reflected(Index n, Index bandwidth) {
  const auto t = [&](Index d) { return d <= bandwidth ? std::pow(0.5, static_cast<double>(d)) : 0; };
  Matrix K(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) K(i, j) = t(std::abs(i - j)) - t(i + j + 2) - t(2 * n - i - j);
  }
  return K;
}

// Diagonally dominant, with entries <= 0 beside the diagonal as far as `b`.
Matrix MMatrixOfBand(LcpGenerator& generator, Index n, Index b) {
  Matrix M = Matrix::Zero(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = std::max<Index>(0, i - b); j <= std::min(n - 1, i + b); ++j) M(i, j) = -generator.Uniform(0, 1);
    M(i, i) = 0.1 - M.row(i).sum() + M(i, i);
  }
  return M;
}

TEST(BandProductTest, IsThatOfTheMatrix) {
  LcpGenerator generator(1);
  for (const Index n : {1, 2, 7, 40, 131}) {
    for (const Index b : {0, 1, 3, 6, 19}) {
      if (n <= b) continue;
      for (const Matrix& K : {MMatrixOfBand(generator, n, b), Reflected(n, b)}) {
        BandProduct product(K, b);
        for (int k = 0; k < 3; ++k) {
          const Vector y = generator.GaussianVector(n);
          Vector result;
          product(y, result);
          const double width = static_cast<double>(b);
          EXPECT_LE(MaxAbs(result - K * y), 1e-14 * (1 + width) * InfinityNorm(K) * MaxAbs(y)) << n << " " << b;
        }
      }
    }
  }
}

TEST(BandProductTest, SeesWhatFixedEndsReflect) {
  LcpGenerator generator(3);
  EXPECT_TRUE(BandProduct(Reflected(40, 12), 12).is_reflected());
  EXPECT_FALSE(BandProduct(MMatrixOfBand(generator, 40, 12), 12).is_reflected());
  Matrix K = Reflected(40, 12);
  K(0, 0) += 1e-3;
  EXPECT_FALSE(BandProduct(K, 12).is_reflected());
}

TEST(BandwidthTest, LeavesRoundingOut) {
  Matrix K = Reflected(50, 9);
  EXPECT_EQ(BandwidthUpToRounding(K), 9);
  K(3, 40) = 1e-16;
  EXPECT_EQ(BandwidthUpToRounding(K), 9);
  K(40, 3) = 1e-10;
  EXPECT_EQ(BandwidthUpToRounding(K), 37);
  EXPECT_EQ(BandwidthUpToRounding(Matrix::Identity(4, 4)), 1);
}

TEST(BandFactorTest, SolvesInEveryBasisAndKeepsItsBits) {
  LcpGenerator generator(2);
  // In the longer ones a change dies away before the end.
  for (const auto& [n, b] :
       std::vector<std::pair<Index, Index>>{{60, 1}, {60, 2}, {60, 8}, {60, 20}, {300, 2}, {300, 8}, {300, 40}}) {
    const Matrix M = MMatrixOfBand(generator, n, b);
    const auto band = std::make_shared<const BandMatrix>(M, b);
    EXPECT_TRUE(BandFactor::IsClearlyMMatrix(*band));
    BandFactor kept(band);
    Basis basis(n, 1);
    for (int k = 0; k < 40; ++k) {
      for (int flips = 0; flips < k % 5; ++flips) basis[static_cast<std::size_t>(generator.Uniform(0, n))] ^= 1;
      Vector x = generator.GaussianVector(n);
      for (Index i = 0; i < n; ++i) x[i] = basis[static_cast<std::size_t>(i)] ? x[i] : 0;
      const Vector right = x;
      Vector again = x;
      kept.Factor(basis);
      kept.Solve(x);
      BandFactor fresh(band);
      fresh.Factor(basis);
      fresh.Solve(again);
      EXPECT_EQ(x, again);
      const Vector image = M * x;
      for (Index i = 0; i < n; ++i) {
        if (basis[static_cast<std::size_t>(i)]) {
          EXPECT_NEAR(image[i], right[i], 1e-12 * (1 + MaxAbs(x)));
        } else {
          EXPECT_EQ(x[i], 0);
        }
      }
    }
  }
}

TEST(BandFactorTest, KnowsMMatrices) {
  EXPECT_TRUE(BandFactor::IsClearlyMMatrix(BandMatrix(2 * Matrix::Identity(5, 5), 1)));
  Matrix M = 4 * Matrix::Identity(5, 5);
  M.diagonal(1).setConstant(1);
  EXPECT_FALSE(BandFactor::IsClearlyMMatrix(BandMatrix(M, 1)));
  M.diagonal(1).setConstant(-4);
  M.diagonal(-1).setConstant(-4);
  EXPECT_FALSE(BandFactor::IsClearlyMMatrix(BandMatrix(M, 1)));
}

}  // namespace
}  // namespace dlcs
