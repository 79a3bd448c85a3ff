// SPDX-License-Identifier: Apache-2.0
// Whatever registers serve, and however the work is tiled: the bits of plain loops.
#include "core/linalg/simd/elimination_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "core/matrix_classes/m_matrix.h"
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

TEST(EliminationLoopsTest, AddColumnsHasTheBitsOfSingleUpdates) {
  LcpGenerator generator(4);
  for (Index rows = 1; rows < 90; ++rows) {
    const Matrix M = generator.Gaussian(rows, 7);
    const std::vector<Index> columns = {5, 0, 2, 6};
    const Vector x = generator.GaussianVector(4), w = generator.GaussianVector(rows);
    Vector wide = w, plain = w;
    AddColumns(rows, columns, x.data(), M.data(), wide.data());
    for (std::size_t k = 0; k < columns.size(); ++k) {
      for (Index i = 0; i < rows; ++i) plain[i] += x[static_cast<Index>(k)] * M(i, columns[k]);
    }
    ASSERT_EQ(wide, plain) << rows;
  }
}

// Rows of P, in the order of `source`, are those of L U; substitution undoes both.
TEST(EliminationLoopsTest, EliminatesByPivotsAndSubstitutes) {
  LcpGenerator generator(5);
  for (const Index size : {1, 2, 7, 8, 9, 15, 16, 17, 31, 40, 65}) {
    for (const Index panel : {Index{3}, size}) {
      const Matrix A = generator.Gaussian(size, size);
      Matrix lu = A;
      Vector inverse(size);
      std::vector<Index> source(size);
      std::iota(source.begin(), source.end(), Index{0});
      for (Index begin = 0; begin < size; begin += panel) {
        const Index end = std::min(begin + panel, size), behind = size - end;
        ASSERT_TRUE(EliminateColumns(begin, end, size, 1e-13, lu.data(), size, inverse.data(), source.data()));
        if (behind == 0) break;
        for (Index j = end; j < size; ++j) SubstituteForward(end - begin, &lu(begin, begin), size, &lu(begin, j));
        SubtractProduct(behind, behind, end - begin, &lu(end, begin), size, &lu(begin, end), size, &lu(end, end), size);
      }
      const Matrix L = Matrix(lu.triangularView<Eigen::UnitLower>()), U = Matrix(lu.triangularView<Eigen::Upper>());
      EXPECT_LE((L * U - A(source, Eigen::all)).lpNorm<Eigen::Infinity>(), 1e-13 * static_cast<double>(size)) << size;
      EXPECT_LE(L.cwiseAbs().maxCoeff(), 1);  // every pivot was the largest of its column
      const Vector x = generator.GaussianVector(size);
      Vector solved = L * (U * x);
      SubstituteForward(size, lu.data(), size, solved.data());
      SubstituteBackward(size, lu.data(), size, inverse.data(), solved.data());
      EXPECT_LE((solved - x).lpNorm<Eigen::Infinity>(), 1e-9) << size;
    }
  }
}

TEST(EliminationLoopsTest, FindsNoPivotInASingularMatrix) {
  Matrix lu(3, 3);
  lu << 1, 2, 3, 2, 4, 6, 1, 1, 1;
  Vector inverse(3);
  std::vector<Index> source = {0, 1, 2};
  EXPECT_FALSE(EliminateColumns(0, 3, 3, 1e-14, lu.data(), 3, inverse.data(), source.data()));
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
