// SPDX-License-Identifier: Apache-2.0
// The constants L, 𝓛, v_∞ and the bound (2.6) of [Chen & Xiang 2013].
#include "core/matrix_classes/lipschitz.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

double NormOf(const Matrix& M) { return M.cwiseAbs().rowwise().sum().maxCoeff(); }

// ‖(I - D + D M)⁻¹ D‖_∞ of (2.6).
double BoundAt(const Matrix& M, const Vector& d) {
  const Matrix D = d.asDiagonal();
  return NormOf((Matrix::Identity(M.rows(), M.rows()) - D + D * M).inverse() * D);
}

TEST(LipschitzTest, HasThePrintedConstantInExample41) {
  const LipschitzBound bound = BoundLipschitz(testing::ChenXiangExample41());
  EXPECT_EQ(*bound.value, 1);
  EXPECT_EQ(bound.kind, ConstantKind::kExact);
}

TEST(LipschitzTest, VanishesInRemark22WhereMangasarianAndShiausDoesNot) {
  for (const double tau : {2.0, 1.0, 1e-3, 1e-9}) {
    const Matrix M{{0, 0}, {-tau, 0}};
    EXPECT_EQ(*LipschitzConstant(M), 0);
    const LipschitzBound v = MangasarianShiauConstant(M);
    EXPECT_EQ(v.kind, ConstantKind::kExact);
    EXPECT_NEAR(*v.value * tau, std::max(1.0, tau), 1e-12);
  }
}

// The definition by random u: no quotient exceeds the maximum over bases, and the search comes near it.
TEST(LipschitzTest, BoundsEveryMultiplierOfMangasarianAndShiau) {
  LcpGenerator generator(1);
  for (int round = 0; round < 60; ++round) {
    const Index n = generator.Integer(1, 4);
    const Matrix M = generator.Gaussian(n, n);
    const double v = *MangasarianShiauConstant(M).value;
    EXPECT_GE(v, *LipschitzConstant(M) * (1 - 1e-12));  // Proposition 2.1
    Matrix P(2 * n, n);
    P << M, Matrix::Identity(n, n);
    std::vector<Index> rows(2 * n);
    double best = 0;
    for (int trial = 0; trial < 4000; ++trial) {
      for (Index i = 0; i < 2 * n; ++i) rows[i] = i;
      std::shuffle(rows.begin(), rows.end(), generator.engine());
      const std::vector<Index> chosen(rows.begin(), rows.begin() + n);
      const Matrix B = P(chosen, Eigen::all);
      // Extreme points: z = B^T u a unit vector.
      const Index i = generator.Integer(0, n - 1);
      const Vector u = B.transpose().fullPivLu().solve(Vector::Unit(n, i));
      if ((B.transpose() * u - Vector::Unit(n, i)).norm() > 1e-9) continue;
      best = std::max(best, u.lpNorm<1>() / (B.transpose() * u).lpNorm<1>());
      EXPECT_LE(best, v * (1 + 1e-9));
    }
    EXPECT_GE(best, 0.9 * v);
  }
}

// (2.6) is no weaker than (2.5): the maximum over the cube is attained at its corners, where it is L.
TEST(LipschitzTest, IsTheBoundOverAllDiagonalMatricesForPMatrices) {
  LcpGenerator generator(2);
  double nearest = 0;
  for (int round = 0; round < 200; ++round) {
    const Index n = generator.Integer(1, 5);
    const Matrix M = round % 2 == 0 ? generator.IndefinitePMatrix(n) : generator.PositiveDefinite(n);
    const double L = *LipschitzConstant(M);
    for (int trial = 0; trial < 50; ++trial) {
      Vector d(n);
      for (Index i = 0; i < n; ++i) d[i] = generator.Uniform(0, 1);
      const double inside = BoundAt(M, d);
      EXPECT_LE(inside, L * (1 + 1e-9));
      // Along each axis the larger end is no smaller.
      const Index i = generator.Integer(0, n - 1);
      Vector low = d, high = d;
      low[i] = 0;
      high[i] = 1;
      EXPECT_LE(inside, std::max(BoundAt(M, low), BoundAt(M, high)) * (1 + 1e-9));
      nearest = std::max(nearest, inside / L);
    }
  }
  EXPECT_GT(nearest, 0.9);
}

TEST(LipschitzTest, BoundsLargeMatricesFromAbove) {
  LcpGenerator generator(3);
  for (int round = 0; round < 20; ++round) {
    // Diagonally dominant, of mixed signs: an H-matrix. The bound must hold for every principal block.
    Matrix M = generator.Gaussian(14, 14);
    M.diagonal() = M.cwiseAbs().rowwise().sum() + Vector::Ones(14);
    const LipschitzBound bound = BoundLipschitz(M);
    EXPECT_EQ(bound.kind, ConstantKind::kUpperBound);
    for (int trial = 0; trial < 20; ++trial) {
      std::vector<Index> S;
      for (Index i = 0; i < 14; ++i) {
        if (generator.Integer(0, 1)) S.push_back(i);
      }
      if (S.empty()) continue;
      EXPECT_LE(NormOf(M(S, S).inverse()), *bound.value * (1 + 1e-12));
    }
  }
  EXPECT_FALSE(BoundLipschitz(generator.Gaussian(14, 14)).value.has_value());
}

// The definition, index set by index set, with determinants for "nonsingular": none of the problems below comes near
// it otherwise.
double ByDefinition(const Matrix& M) {
  double largest = 0;
  const Index n = M.rows();
  for (unsigned subset = 1; subset < (1u << n); ++subset) {
    std::vector<Index> S;
    for (Index i = 0; i < n; ++i) {
      if (subset >> i & 1u) S.push_back(i);
    }
    const Matrix block = M(S, S);
    if (std::abs(block.determinant()) > 1e-9) largest = std::max(largest, NormOf(block.inverse()));
  }
  return largest;
}

TEST(LipschitzTest, IsTheMaximumOverAllNonsingularBlocks) {
  LcpGenerator generator(4);
  for (int round = 0; round < 200; ++round) {
    const Index n = generator.Integer(1, 7);
    Matrix M = generator.Gaussian(n, n);
    switch (round % 4) {
      case 0:
        M = generator.ZMatrix(n);
        break;
      case 1:
        M = generator.MMatrix(n);  // by ‖M⁻¹‖_∞ alone
        break;
      case 2:  // small integers: many blocks are singular; other determinants are at least one
        M = M.unaryExpr([](double value) { return std::round(value); });
        break;
      default:
        break;
    }
    const LipschitzBound bound = BoundLipschitz(M);
    EXPECT_EQ(bound.kind, ConstantKind::kExact);
    EXPECT_NEAR(*bound.value, ByDefinition(M), 1e-8 * (1 + *bound.value)) << "M =\n" << M;
  }
}

// One size beyond the enumeration, against the enumeration in full.
TEST(LipschitzTest, IsNeverBelowTheTruthBeyondEnumeration) {
  LcpGenerator generator(5);
  const Index n = 13;
  const Matrix m_matrix = generator.MMatrix(n);
  EXPECT_NEAR(*BoundLipschitz(m_matrix).value, ByDefinition(m_matrix), 1e-9 * *BoundLipschitz(m_matrix).value);
  Matrix dominant = generator.Gaussian(n, n);
  dominant.diagonal() = dominant.cwiseAbs().rowwise().sum() + Vector::Ones(n);
  for (const Matrix& M : {dominant, generator.PositiveDefinite(n)}) {
    const LipschitzBound bound = BoundLipschitz(M);
    EXPECT_EQ(bound.kind, ConstantKind::kUpperBound) << bound.why;
    EXPECT_GE(*bound.value, ByDefinition(M) * (1 - 1e-9)) << bound.why;
  }
}

TEST(LipschitzTest, SlopeOfTheLeastNormUsesPseudoInverses) {
  EXPECT_NEAR(*LargestSlope(Matrix::Ones(2, 2)), 1, 1e-14);  // 1×1 blocks: 1; ones(2)⁺ = ones/4
  EXPECT_EQ(*LargestSlope(Matrix::Zero(3, 3)), 0);
  const Matrix M{{2, 1}, {0, -1}};
  EXPECT_NEAR(*LargestSlope(M), *LipschitzConstant(M), 1e-14);
}

}  // namespace
}  // namespace dlcs
