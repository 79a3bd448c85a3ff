// SPDX-License-Identifier: Apache-2.0
// Whatever registers serve, and however the work is tiled: the bits of plain loops.
#include "core/linalg/elimination_loops.h"

#include <gtest/gtest.h>

#include "core/analysis/m_matrix.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

TEST(EliminationLoopsTest, SubtractMultipleHasTheBitsOfAPlainLoop) {
  LcpGenerator generator(1);
  for (Index count = 0; count < 100; ++count) {
    const Vector x = generator.GaussianVector(count), y = generator.GaussianVector(count);
    const double factor = generator.Normal();
    Vector wide = y, plain = y;
    SubtractMultiple(count, factor, x.data(), wide.data());
    for (Index i = 0; i < count; ++i) plain[i] -= factor * x[i];
    ASSERT_EQ(wide, plain) << count;
  }
}

TEST(EliminationLoopsTest, SubtractProductHasTheBitsOfSingleUpdates) {
  LcpGenerator generator(2);
  for (int k = 0; k < 200; ++k) {
    const Index rows = generator.Integer(0, 70), columns = generator.Integer(0, 20), depth = generator.Integer(0, 20);
    const Matrix L = generator.Gaussian(rows + 3, depth), U = generator.Gaussian(depth + 2, columns);
    const Matrix A = generator.Gaussian(rows + 1, columns);
    Matrix wide = A, plain = A;
    SubtractProduct(rows, columns, depth, L.data(), L.rows(), U.data(), U.rows(), wide.data(), wide.rows());
    for (Index p = 0; p < depth; ++p) {
      for (Index j = 0; j < columns; ++j) {
        for (Index i = 0; i < rows; ++i) plain(i, j) -= L(i, p) * U(p, j);
      }
    }
    ASSERT_EQ(wide, plain) << rows << "x" << columns << "x" << depth;  // the row below is not touched
  }
}

// Panels of columns have the bits of an elimination by single columns.
TEST(EliminationLoopsTest, PanelsFactorMMatrices) {
  LcpGenerator generator(3);
  for (const Index n : {1, 11, 12, 13, 24, 40, 101}) {
    const Matrix M = generator.MMatrix(n);
    std::vector<Index> indices(n);
    for (Index i = 0; i < n; ++i) indices[i] = n - 1 - i;
    MMatrixFactor factor(M);
    ASSERT_EQ(factor.Factor(M, indices), n);
    const Vector x = generator.GaussianVector(n);
    Vector solved = (M * x)(indices), transposed = (M.transpose() * x)(indices);
    factor.Solve(solved);
    factor.SolveTransposed(transposed);
    EXPECT_LE((solved - x(indices)).lpNorm<Eigen::Infinity>(), 1e-11);
    EXPECT_LE((transposed - x(indices)).lpNorm<Eigen::Infinity>(), 1e-11);
    Matrix plain = M(indices, indices);
    for (Index p = 0; p < n; ++p) {
      EXPECT_EQ(factor.pivot(p), plain(p, p));
      const double inverse = 1 / plain(p, p);
      for (Index i = p + 1; i < n; ++i) plain(i, p) *= inverse;
      for (Index j = p + 1; j < n; ++j) {
        for (Index i = p + 1; i < n; ++i) plain(i, j) -= plain(i, p) * plain(p, j);
      }
    }
  }
}

}  // namespace
}  // namespace dlcs
