// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/balance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/linalg/norms.h"
#include "core/linalg/strong_components.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;

// Diffusion along the diagonals of a grid and a weak drift across them, whose signs make it no symmetric matrix: strong
// and weak couplings form a graph of many circles.
Matrix DiagonalDiffusion(Index side) {
  Matrix A = Matrix::Zero(side * side, side * side);
  const auto couple = [&](Index i, Index j, Index to_i, Index to_j, double weight) {
    if (to_i >= 0 && to_i < side && to_j >= 0 && to_j < side) A(j * side + i, to_j * side + to_i) = weight;
  };
  for (Index j = 0; j < side; ++j) {
    for (Index i = 0; i < side; ++i) {
      couple(i, j, i, j, -1.49);
      couple(i, j, i - 1, j - 1, 0.72);
      couple(i, j, i + 1, j + 1, 0.72);
      for (const Index sign : {-1, 1}) {
        couple(i, j, i + sign, j, 0.01 * static_cast<double>(sign));
        couple(i, j, i, j + sign, 0.01 * static_cast<double>(sign));
      }
    }
  }
  return A;
}

double SumOf(const Matrix& matrix) { return matrix.cwiseAbs().sum(); }

TEST(BalanceTest, FindsTheBlocks) {
  Matrix A = Matrix::Zero(5, 5);  // 0 <-> 3, 1 <-> 4, and 2 drives both, 0 drives 1
  A(0, 3) = A(3, 0) = A(1, 4) = A(4, 1) = A(0, 2) = A(4, 2) = A(1, 0) = 1;
  const std::vector<std::vector<Index>> expected = {{1, 4}, {0, 3}, {2}};
  EXPECT_EQ(StronglyConnected(A), expected);
}

TEST(BalanceTest, ScalesWithoutRounding) {
  Vector units(8);
  units << 0x1p0, 0x1p40, 0x1p-37, 0x1p12, 0x1p3, 0x1p-50, 0x1p22, 0x1p9;
  const Matrix A = units.asDiagonal() * RandomMatrix(8, 8, 3) * units.cwiseInverse().asDiagonal();
  const BalancedMatrix balanced = Balance(A);
  for (Index k = 0; k < 8; ++k) {
    for (Index l = 0; l < 8; ++l) {
      EXPECT_EQ(std::ldexp(balanced.matrix(k, l), balanced.exponents[k] - balanced.exponents[l]),
                A(balanced.order[k], balanced.order[l]));
    }
  }
  EXPECT_LE(InfinityNorm(balanced.matrix), 16);
}

TEST(BalanceTest, ScalesCouplingsOfBlocks) {
  Matrix A(2, 2);
  A << -1, 1e200, 0, -3;
  const BalancedMatrix balanced = Balance(A);
  EXPECT_LE(balanced.matrix(0, 1), 4);
  EXPECT_GE(balanced.matrix(0, 1), 1);
}

TEST(BalanceTest, LeavesAMatrixOfSymmetricSizesAsItIs) {
  const Matrix A = DiagonalDiffusion(11);
  const BalancedMatrix balanced = Balance(A);
  EXPECT_EQ(balanced.num_blocks(), 1);
  for (const int exponent : balanced.exponents) EXPECT_EQ(exponent, balanced.exponents.front());
}

TEST(BalanceTest, FindsTheUnitsOfAMatrixOfSymmetricSizes) {
  std::mt19937 random(7);
  for (const Index side : {2, 5, 9}) {
    const Matrix A = DiagonalDiffusion(side);
    Vector units(A.rows());
    for (double& unit : units) unit = std::ldexp(1.0, static_cast<int>(random() % 80) - 40);
    const BalancedMatrix balanced = Balance(units.asDiagonal() * A * units.cwiseInverse().asDiagonal());
    EXPECT_EQ(SumOf(balanced.matrix), SumOf(Balance(A).matrix)) << side;
    EXPECT_EQ(SumOf(balanced.matrix), SumOf(A)) << side;
  }
}

TEST(BalanceTest, IsTheSameInAnyUnitsOfStatesAndTime) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    const Index size = 2 + static_cast<Index>(random() % 12);
    Matrix A(size, size);
    for (double& entry : A.reshaped()) {
      entry = random() % 3 == 0 ? 0 : std::ldexp(normal(random), static_cast<int>(random() % 40) - 20);
    }
    Vector units(size);
    for (double& unit : units) unit = std::ldexp(1.0, static_cast<int>(random() % 60) - 30);
    const BalancedMatrix one = Balance(A);
    const BalancedMatrix other = Balance(0x1p-9 * (units.asDiagonal() * A * units.cwiseInverse().asDiagonal()));
    ASSERT_EQ(one.order, other.order);
    ASSERT_EQ(one.begins, other.begins);
    // The units of blocks may depend on those of time, the blocks themselves do not.
    for (Index b = 0; b < one.num_blocks(); ++b) {
      const Index begin = one.begins[b], size_of_block = one.size_of_block(b);
      const auto block = [&](const BalancedMatrix& balanced) {
        return Matrix(balanced.matrix.block(begin, begin, size_of_block, size_of_block));
      };
      EXPECT_EQ(block(one), 0x1p9 * block(other));
    }
  }
}

TEST(BalanceTest, NoPowerOfTwoForOneStateMakesRowsAndColumnsMuchSmaller) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 100; ++trial) {
    const Index size = 3 + static_cast<Index>(random() % 10);
    Matrix A(size, size);
    for (double& entry : A.reshaped()) entry = std::ldexp(normal(random), static_cast<int>(random() % 30) - 15);
    const BalancedMatrix balanced = Balance(A);
    ASSERT_EQ(balanced.num_blocks(), 1);
    for (Index i = 0; i < size; ++i) {
      const double own = std::abs(balanced.matrix(i, i));
      const double row = balanced.matrix.row(i).cwiseAbs().sum() - own;
      const double column = balanced.matrix.col(i).cwiseAbs().sum() - own;
      for (const double factor : {0.5, 2.0}) EXPECT_GE(row / factor + column * factor, 0.94 * (row + column));
    }
  }
}

}  // namespace
}  // namespace dlcs
