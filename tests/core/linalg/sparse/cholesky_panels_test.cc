// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/cholesky_panels.h"

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <random>
#include <vector>

#include "core/linalg/norms.h"
#include "core/linalg/sparse/sparse_factor.h"

namespace dlcs {
namespace {

// I - Δ on side × side points, with some couplings of distant ones.
SparseMatrix PlaneWithLinks(Index side, int links) {
  std::mt19937 random(5);
  const Index size = side * side;
  std::uniform_int_distribution<Index> point(0, size - 1);
  std::vector<Eigen::Triplet<double>> entries;
  const auto couple = [&](Index i, Index j) {
    for (const auto& [row, column] : {std::pair(i, j), std::pair(j, i)}) {
      entries.emplace_back(row, row, 1);
      entries.emplace_back(row, column, -1);
    }
  };
  for (Index i = 0; i < size; ++i) {
    entries.emplace_back(i, i, 1);
    if (i % side + 1 < side) couple(i, i + 1);
    if (i + side < size) couple(i, i + side);
  }
  for (int k = 0; k < links; ++k) couple(point(random), point(random));
  SparseMatrix K(size, size);
  K.setFromTriplets(entries.begin(), entries.end());
  return K;
}

TEST(CholeskyPanelsTest, SolveAsColumnsDo) {
  for (const auto& [side, links] : {std::pair<Index, int>(1, 0), {2, 0}, {7, 3}, {40, 0}, {40, 200}}) {
    SparseMatrix K;
    K = PlaneWithLinks(side, links).twistedBy(SparseOrder(PlaneWithLinks(side, links)));
    const Eigen::SimplicialLLT<SparseMatrix, Eigen::Lower, Eigen::NaturalOrdering<int>> columns(K);
    const SparseMatrix L = columns.matrixL();
    const CholeskyPanels panels(L);
    EXPECT_GE(panels.numbers(), L.nonZeros());
    EXPECT_LE(panels.numbers(), 2 * L.nonZeros() + 64) << side;
    const Vector b = Vector::LinSpaced(K.rows(), -1, 2);
    Vector x = b;
    panels.SolveForward(x);
    EXPECT_LE(MaxAbs(Vector(L * x - b)), 1e-13) << side << " " << links;
    panels.SolveBackward(x);
    EXPECT_LE(MaxAbs(Vector(K * x - b)), 1e-12) << side << " " << links;
    EXPECT_LE(MaxAbs(Vector(x - columns.solve(b))), 1e-13) << side << " " << links;
  }
}

TEST(CholeskyPanelsTest, KeepZerosThatNothingReaches) {
  const SparseMatrix K = PlaneWithLinks(30, 0);
  const Eigen::SimplicialLLT<SparseMatrix, Eigen::Lower, Eigen::NaturalOrdering<int>> columns(K);
  const CholeskyPanels panels(SparseMatrix(columns.matrixL()));
  Vector x = Vector::Unit(K.rows(), 600);
  panels.SolveForward(x);
  EXPECT_EQ(MaxAbs(x.head(600)), 0);
  EXPECT_GT(x[600], 0);
  EXPECT_GT(MaxAbs(x.tail(100)), 0);
}

TEST(SparseFactorTest, SolvesInTwoHalves) {
  const SparseMatrix A = -PlaneWithLinks(30, 20);
  const SparseFactor<double> factor(A, SparseOrder(A), 1.0, 0.5);
  ASSERT_TRUE(factor.has_halves());
  const Vector b = Vector::LinSpaced(A.rows(), -1, 2), c = Vector::Unit(A.rows(), 17);
  const Vector x = factor.Solve(b), half_of_b = factor.FirstHalf(b), half_of_c = factor.FirstHalf(c);
  EXPECT_EQ(x, factor.SecondHalf(half_of_b));
  EXPECT_NEAR(half_of_c.dot(half_of_b), c.dot(x), 1e-14);
  EXPECT_LT((half_of_c.array() != 0).count(), A.rows() / 2);

  SparseMatrix flow = A;
  flow.coeffRef(0, 1) = 3;
  EXPECT_FALSE(SparseFactor<double>(flow, SparseOrder(flow), 1.0, 0.5).has_halves());
}

}  // namespace
}  // namespace dlcs
