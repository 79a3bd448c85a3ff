// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/relative_degree.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <optional>

#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

TEST(RelativeDegreeTest, CountsTheIntegratorsOfAChain) {
  for (const int length : {1, 2, 3, 8, 40}) {
    Matrix A = Matrix::Zero(length, length);
    for (int i = 0; i + 1 < length; ++i) A(i, i + 1) = 1e6;
    Matrix B = Matrix::Zero(length, 1);
    B(length - 1, 0) = 1e-9;
    Matrix N = Matrix::Zero(1, length);
    N(0, 0) = 1e-9;
    EXPECT_EQ(RelativeDegree(A, B, N), length);
  }
}

TEST(RelativeDegreeTest, IsAbsentWhereYNeverActsOnW) {
  EXPECT_EQ(RelativeDegree(Matrix::Zero(1, 1), Matrix::Zero(1, 1), Matrix::Zero(1, 1)), std::nullopt);
  const Matrix A{{-1, 0}, {5, -2}};
  EXPECT_EQ(RelativeDegree(A, Vector{{0.0, 1}}, Vector{{1.0, 0}}.transpose()), std::nullopt);
  EXPECT_EQ(RelativeDegree(A, Vector{{1.0, 0}}, Vector{{0.0, 1}}.transpose()), 2);
}

// In other coordinates the zeros are sums that cancel to rounding.
TEST(RelativeDegreeTest, DoesNotMistakeRoundingForAnAction) {
  testing::LcpGenerator generator(1);
  Matrix A = Matrix::Zero(6, 6);
  for (int i = 0; i < 5; ++i) A(i, i + 1) = 1;
  A.row(5).setConstant(-0.5);
  const Matrix B = Matrix::Identity(6, 6).rightCols(1);
  const Matrix N = Matrix::Identity(6, 6).topRows(1);
  for (int k = 0; k < 20; ++k) {
    const Matrix T = generator.PositiveDefinite(6) + Matrix::Identity(6, 6);
    const Matrix inverse = T.inverse();
    EXPECT_EQ(RelativeDegree(T * A * inverse, T * B, N * inverse), 6);
  }
}

TEST(RelativeDegreeTest, IsOneAsSoonAsSomeEntryActs) {
  const Matrix A = Matrix::Zero(2, 2);
  EXPECT_EQ(RelativeDegree(A, Matrix::Identity(2, 2), Matrix{{0, 0}, {0, 1e-12}}), 1);
}

}  // namespace
}  // namespace dlcs
