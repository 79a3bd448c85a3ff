// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/structural_zeros.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace dlcs {
namespace {

// An open switch, y = (v, i), beside other pairs: i is determined alone, by a row whose diagonal is zero.
TEST(StructuralZerosTest, WhatOneRowDeterminesAloneDependsOnNoOther) {
  const Matrix M{{0.02, 0, -0.01, -1}, {0, 0, -1, 0}, {-0.01, 1, 0.02, 1}, {1, 0, -1, 4e-6}};
  Matrix inverse = M.inverse() + 1e-18 * Matrix::Ones(4, 4);
  ClearStructuralZeros(M, inverse);
  EXPECT_EQ(inverse.row(2), (Eigen::RowVector4d{{0, inverse(2, 1), 0, 0}}));
  EXPECT_NEAR(inverse(2, 1), -1, 1e-15);
  // The other three depend on all but the row of v, which v alone does.
  EXPECT_NE(inverse(1, 2), 0);
  EXPECT_EQ(inverse(0, 2), 0);
  EXPECT_EQ(inverse(3, 2), 0);
  EXPECT_NE(inverse(0, 0), 0);
  EXPECT_NE(inverse(3, 1), 0);
}

// Sparse integer matrices with random values: an entry is cleared if and only if it is zero for other values too.
TEST(StructuralZerosTest, AreThoseOfTheInverseForAllValues) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> value(0.5, 2), chance(0, 1);
  int cleared = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Index n = 2 + trial % 7;
    Matrix one = Matrix::Zero(n, n), other = one;
    for (Index k = 0; k < n * n; ++k) {
      if (chance(generator) > 0.35) continue;
      one(k) = value(generator);
      other(k) = value(generator);
    }
    const Eigen::FullPivLU<Matrix> lu(one), second(other);
    if (!lu.isInvertible() || !second.isInvertible() || lu.rcond() < 1e-6 || second.rcond() < 1e-6) continue;
    Matrix inverse = Matrix::Ones(n, n);
    ClearStructuralZeros(one, inverse);
    const Matrix a = lu.inverse(), b = second.inverse();
    for (Index k = 0; k < n * n; ++k) {
      const bool is_zero = std::abs(a(k)) < 1e-9 && std::abs(b(k)) < 1e-9;
      EXPECT_EQ(inverse(k) == 0, is_zero) << one << "\n" << a;
      cleared += is_zero ? 1 : 0;
    }
  }
  EXPECT_GT(cleared, 300);
}

}  // namespace
}  // namespace dlcs
