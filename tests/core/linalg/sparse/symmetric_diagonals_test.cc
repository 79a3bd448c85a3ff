// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/symmetric_diagonals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "core/linalg/norms.h"
#include "core/linalg/structured_matrix.h"

namespace dlcs {
namespace {

using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor>;

CompressedRows<double> RowsOf(const RowMajor& K) {
  CompressedRows<double> rows{.cols = K.cols()};
  rows.start.assign(K.outerIndexPtr(), K.outerIndexPtr() + K.rows() + 1);
  rows.column.assign(K.innerIndexPtr(), K.innerIndexPtr() + K.nonZeros());
  rows.value.assign(K.valuePtr(), K.valuePtr() + K.nonZeros());
  return rows;
}

// Points of a plane, each with a neighbor on either side in both directions, and `links` couplings elsewhere.
RowMajor Plane(Index side, Index links) {
  const Index size = side * side;
  std::vector<Eigen::Triplet<double>> entries;
  const auto couple = [&](Index i, Index j, double value) {
    entries.emplace_back(i, j, value);
    entries.emplace_back(j, i, value);
  };
  for (Index i = 0; i < size; ++i) {
    entries.emplace_back(i, i, 4 + 0.01 * static_cast<double>(i));
    if (i % side + 1 < side) couple(i, i + 1, -1 - 0.001 * static_cast<double>(i));
    if (i + side < size) couple(i, i + side, -0.5);
  }
  for (Index k = 0; k < links; ++k) couple(2 * k, size - 1 - 3 * k, 0.25);
  RowMajor K(size, size);
  K.setFromTriplets(entries.begin(), entries.end());
  return K;
}

TEST(SymmetricDiagonalsTest, MultiplyAsRowsDo) {
  for (const auto& [side, links] : {std::pair<Index, Index>(1, 0), {9, 0}, {9, 5}, {50, 100}}) {
    const RowMajor K = Plane(side, links);
    const auto diagonals = SymmetricDiagonals::Of(RowsOf(K));
    ASSERT_TRUE(diagonals) << side << " " << links;
    const Vector x = Vector::LinSpaced(K.rows(), -1, 2), expected = K * x;
    Vector product(K.rows());
    diagonals->MultiplyRows(x.data(), 0, K.rows(), product.data());
    EXPECT_LE(MaxAbs(Vector(product - expected)), 1e-13) << side << " " << links;
    // The bits do not depend on how rows are divided.
    Vector parts(K.rows());
    for (Index begin = 0; begin < K.rows(); begin += 37) {
      diagonals->MultiplyRows(x.data(), begin, std::min<Index>(begin + 37, K.rows()), parts.data() + begin);
    }
    EXPECT_EQ(parts, product) << side << " " << links;
  }
}

TEST(SymmetricDiagonalsTest, AreAbsentWhereNothingIsSaved) {
  RowMajor K = Plane(9, 0);
  K.coeffRef(3, 4) += 1e-15;
  EXPECT_FALSE(SymmetricDiagonals::Of(RowsOf(K)));
  // Points in another order.
  Eigen::PermutationMatrix<Eigen::Dynamic> order(81);
  order.setIdentity();
  std::shuffle(order.indices().data(), order.indices().data() + 81, std::mt19937(3));
  SparseMatrix shuffled;
  shuffled = SparseMatrix(Plane(9, 0)).twistedBy(order);
  EXPECT_FALSE(SymmetricDiagonals::Of(RowsOf(RowMajor(shuffled))));
}

}  // namespace
}  // namespace dlcs
