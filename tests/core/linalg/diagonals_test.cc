// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/diagonals.h"

#include <gtest/gtest.h>

namespace dlcs {
namespace {

Eigen::SparseMatrix<double> Banded(Index rows, Index cols, const std::vector<Index>& shifts) {
  Matrix dense = Matrix::Zero(rows, cols);
  for (const Index shift : shifts) dense.diagonal(shift).setRandom();
  return dense.sparseView();
}

TEST(DiagonalsTest, MultipliesWithTheBitsOfTheSparseProduct) {
  std::srand(3);
  for (const auto& [rows, cols] : {std::pair<Index, Index>{23, 23}, {23, 40}, {40, 23}}) {
    const auto matrix = Banded(rows, cols, {-5, -1, 0, 1, 7});
    const Matrix values = Matrix::Random(cols, 9);
    const auto diagonals = Diagonals::Of(matrix);
    ASSERT_TRUE(diagonals);
    Matrix product(rows, 9);
    diagonals->Multiply(values, product);
    EXPECT_EQ(product, Matrix(matrix * values));
  }
}

TEST(DiagonalsTest, LeavesGapsAndManyDiagonalsToOthers) {
  std::srand(4);
  Eigen::SparseMatrix<double> gap = Banded(9, 9, {0, 1});
  gap.prune([](Index row, Index column, double) { return row != 3 || column != 4; });
  EXPECT_FALSE(Diagonals::Of(gap));
  EXPECT_FALSE(Diagonals::Of(Banded(20, 20, {-4, -3, -2, -1, 0, 1, 2, 3, 4})));
}

}  // namespace
}  // namespace dlcs
