// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/factor_panels.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <limits>
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

// Entries at random places and, if `is_symmetric_pattern`, across the diagonal from them. The diagonal, half of it
// negative, dominates its columns, so that all pivots are on it.
SparseMatrix RandomMatrix(std::mt19937& random, Index size, Index entries, bool is_symmetric_pattern) {
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<Index> any(0, size - 1);
  std::vector<Eigen::Triplet<double>> triplets;
  Vector sums = Vector::Ones(size);
  const auto add = [&](Index i, Index j) {
    const double value = normal(random);
    triplets.emplace_back(i, j, value);
    sums[j] += std::abs(value);
  };
  for (Index k = 0; k < entries; ++k) {
    const Index i = any(random), j = any(random);
    if (i == j) continue;
    add(i, j);
    if (is_symmetric_pattern) add(j, i);
  }
  for (Index i = 0; i < size; ++i) triplets.emplace_back(i, i, i % 2 ? -sums[i] : sums[i]);
  SparseMatrix matrix(size, size);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

double MaxColumnSum(const Matrix& matrix) { return matrix.cwiseAbs().colwise().sum().maxCoeff(); }

// The residual of a solve that was as good as one by dense LU.
void ExpectSolves(const Matrix& matrix, const Vector& x, const Vector& b) {
  const Vector by_dense_lu = matrix.partialPivLu().solve(b);
  const double scale = MaxColumnSum(matrix) * MaxAbs(by_dense_lu) + MaxAbs(b);
  constexpr double kRounding = 1e-14;
  EXPECT_LE(MaxAbs(Vector(matrix * by_dense_lu - b)), kRounding * scale);
  EXPECT_LE(MaxAbs(Vector(matrix * x - b)), kRounding * scale) << matrix.rows();
}

constexpr double kThreshold = 0.01;

TEST(FactorPanelsTest, SolveAsColumnsDo) {
  for (const auto& [side, links] : {std::pair<Index, int>(1, 0), {2, 0}, {7, 3}, {40, 0}, {40, 200}}) {
    SparseMatrix K;
    K = PlaneWithLinks(side, links).twistedBy(SparseOrder(PlaneWithLinks(side, links)));
    const Eigen::SimplicialLLT<SparseMatrix, Eigen::Lower, Eigen::NaturalOrdering<int>> columns(K);
    const SparseMatrix L = columns.matrixL();
    const FactorPanels panels = FactorPanels::Cholesky(K).value();
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

TEST(FactorPanelsTest, KeepZerosThatNothingReaches) {
  const SparseMatrix K = PlaneWithLinks(30, 0);
  const Eigen::SimplicialLLT<SparseMatrix, Eigen::Lower, Eigen::NaturalOrdering<int>> columns(K);
  const FactorPanels panels = FactorPanels::Cholesky(K).value();
  Vector x = Vector::Unit(K.rows(), 600);
  panels.SolveForward(x);
  EXPECT_EQ(MaxAbs(x.head(600)), 0);
  EXPECT_GT(x[600], 0);
  EXPECT_GT(MaxAbs(x.tail(100)), 0);
}

TEST(FactorPanelsTest, FactorWithoutSymmetry) {
  std::mt19937 random(11);
  for (const bool is_symmetric_pattern : {false, true}) {
    for (const Index size : {1, 2, 3, 10, 60, 150, 400}) {
      const SparseMatrix unordered = RandomMatrix(random, size, 2 * size, is_symmetric_pattern);
      SparseMatrix matrix;
      matrix = unordered.twistedBy(SparseOrder(unordered));
      const auto panels = FactorPanels::Lu(matrix, kThreshold);
      ASSERT_TRUE(panels.has_value()) << size;
      const Matrix dense(matrix);
      const Vector b = Vector::LinSpaced(size, -1, 2), c = Vector::LinSpaced(size, 3, -2);
      Vector x = b, half_of_c = c;
      panels->SolveForward(x);
      panels->SolveTransposedForward(half_of_c);
      const double product = half_of_c.dot(x), scale = half_of_c.norm() * x.norm();
      panels->SolveBackward(x);
      ExpectSolves(dense, x, b);
      EXPECT_NEAR(c.dot(x), product, 1e-13 * scale) << size;
    }
  }
}

TEST(FactorPanelsTest, AreThoseOfCholeskyWhereTheMatrixIsSymmetric) {
  SparseMatrix K;
  K = PlaneWithLinks(20, 10).twistedBy(SparseOrder(PlaneWithLinks(20, 10)));
  const FactorPanels cholesky = FactorPanels::Cholesky(K).value(), lu = FactorPanels::Lu(K, kThreshold).value();
  EXPECT_EQ(cholesky.numbers(), lu.numbers());
  EXPECT_GT(lu.bytes(), 1.5 * cholesky.bytes());
  EXPECT_EQ(cholesky.bytes_of_a_solve(), lu.bytes_of_a_solve());
  Vector by_cholesky = Vector::LinSpaced(K.rows(), -1, 2), by_lu = by_cholesky, by_transpose = by_cholesky;
  cholesky.SolveForward(by_cholesky);
  lu.SolveForward(by_lu);
  lu.SolveTransposedForward(by_transpose);
  EXPECT_EQ(by_cholesky, by_lu);
  EXPECT_EQ(by_cholesky, by_transpose);
  cholesky.SolveBackward(by_cholesky);
  lu.SolveBackward(by_lu);
  EXPECT_EQ(by_cholesky, by_lu);
}

TEST(FactorPanelsTest, RefuseSmallPivots) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto matrix = [](double first, double below) {
    Matrix entries(2, 2);
    entries << first, 1, below, 4;
    return SparseMatrix(entries.sparseView());
  };
  EXPECT_TRUE(FactorPanels::Lu(matrix(0.01, 1), kThreshold).has_value());
  EXPECT_TRUE(FactorPanels::Lu(matrix(-0.01, 1), kThreshold).has_value());
  EXPECT_FALSE(FactorPanels::Lu(matrix(0.0099, 1), kThreshold).has_value());
  EXPECT_FALSE(FactorPanels::Lu(matrix(0.25, 1), kThreshold).has_value());  // 4 - 1 / 0.25
  EXPECT_FALSE(FactorPanels::Lu(matrix(kNan, 1), kThreshold).has_value());
  EXPECT_FALSE(FactorPanels::Lu(SparseMatrix(3, 3), kThreshold).has_value());
  EXPECT_TRUE(FactorPanels::Cholesky(matrix(1, 1)).has_value());
  EXPECT_FALSE(FactorPanels::Cholesky(matrix(0.1, 1)).has_value());
  EXPECT_FALSE(FactorPanels::Cholesky(matrix(-1, 1)).has_value());
  EXPECT_FALSE(FactorPanels::Cholesky(matrix(kNan, 1)).has_value());
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
  const SparseFactor<double> of_flow(flow, SparseOrder(flow), 1.0, 0.5);
  ASSERT_TRUE(of_flow.has_halves());
  const Vector carried = of_flow.Solve(b), half_of_carried = of_flow.FirstHalf(b);
  EXPECT_EQ(carried, of_flow.SecondHalf(half_of_carried));
  EXPECT_NEAR(of_flow.FirstHalfOfTranspose(c).dot(half_of_carried), c.dot(carried), 1e-14);
}

TEST(SparseFactorTest, SolvesWithAndWithoutMassMatrix) {
  std::mt19937 random(13);
  for (const bool is_symmetric_pattern : {false, true}) {
    constexpr Index kSize = 120;
    const SparseMatrix A = RandomMatrix(random, kSize, 200, is_symmetric_pattern);
    SparseMatrix E = PlaneWithLinks(10, 5);
    E.conservativeResize(kSize, kSize);
    for (Index i = 100; i < kSize; ++i) E.coeffRef(i, i) = 1;
    const Vector b = Vector::LinSpaced(kSize, -1, 2), c = Vector::Unit(kSize, 7);
    for (const SparseMatrix& mass : {SparseMatrix(), E}) {
      const SparseFactor<double> factor(A, SparseOrder(A, mass), 4.0, 0.25, mass);
      ASSERT_TRUE(factor.is_regular());
      ASSERT_TRUE(factor.has_halves());
      const Matrix E_or_one = mass.rows() > 0 ? Matrix(mass) : Matrix(Matrix::Identity(kSize, kSize));
      const Vector x = factor.Solve(b), half = factor.FirstHalf(b);
      ExpectSolves(4 * E_or_one - 0.25 * Matrix(A), x, b);
      EXPECT_EQ(x, factor.SecondHalf(half));
      EXPECT_NEAR(factor.FirstHalfOfTranspose(c).dot(half), x[7], 1e-14 * factor.FirstHalfOfTranspose(c).norm());
    }
  }
}

// A cycle: zE - A has its entries off the diagonal.
TEST(SparseFactorTest, TakesPivotsOffTheDiagonalWithoutHalves) {
  constexpr Index kSize = 50;
  SparseMatrix A(kSize, kSize);
  for (Index i = 0; i < kSize; ++i) A.coeffRef(i, (i + 1) % kSize) = 2 + 0.01 * static_cast<double>(i);
  const SparseFactor<double> factor(A, SparseOrder(A), 1e-3, 1.0);
  ASSERT_TRUE(factor.is_regular());
  EXPECT_FALSE(factor.has_halves());
  const Vector b = Vector::LinSpaced(kSize, -1, 2);
  ExpectSolves(1e-3 * Matrix::Identity(kSize, kSize) - Matrix(A), factor.Solve(b), b);
}

// Wilkinson's blocks with pivots just above the threshold: without other pivots a block grows by 100^6.
TEST(SparseFactorTest, TakesOtherPivotsWhereFactorsGrow) {
  constexpr Index kSize = 8;
  SparseMatrix A(kSize, kSize);
  for (Index i = 0; i < kSize; ++i) {
    for (Index j = 0; j < i; ++j) A.coeffRef(i, j) = 99;
    A.coeffRef(i, kSize - 1) = i + 1 < kSize ? -1 : 0;
  }
  SparseFactor<double>::Order order(kSize);
  order.setIdentity();
  const SparseFactor<double> factor(A, order, 1.0, 1.0);
  ASSERT_TRUE(factor.is_regular());
  EXPECT_FALSE(factor.has_halves());
  const Vector b = Vector::LinSpaced(kSize, -1, 2);
  ExpectSolves(Matrix::Identity(kSize, kSize) - Matrix(A), factor.Solve(b), b);
}

// States and equations in units that are up to 1e16 apart.
TEST(SparseFactorTest, IsRegularInAnyUnits) {
  const SparseMatrix A = PlaneWithLinks(12, 3);
  const Index m = A.rows();
  Vector rows(m), columns(m);
  for (Index i = 0; i < m; ++i) {
    rows[i] = std::pow(10.0, static_cast<double>(i % 17) - 8);
    columns[i] = std::pow(10.0, static_cast<double>((5 * i) % 17) - 8);
  }
  const SparseMatrix scaled_A = rows.asDiagonal() * A * columns.asDiagonal();
  SparseMatrix E(m, m);
  E.setIdentity();
  E = rows.asDiagonal() * E * columns.asDiagonal();
  const SparseFactor<double> factor(scaled_A, SparseOrder(scaled_A, E), 9.0, 1.0, E);
  ASSERT_TRUE(factor.is_regular());
  const Vector b = rows.cwiseProduct(Vector::LinSpaced(m, -1, 2));
  const SparseMatrix K = 9 * E - scaled_A;
  const Vector x = factor.Solve(b);
  const Vector terms = K.cwiseAbs() * x.cwiseAbs() + b.cwiseAbs();
  EXPECT_LE(MaxAbs((b - K * x).cwiseQuotient(terms)), 1e-11);  // the probe, of another b, is held to a tenth
}

// Symmetric, and neither definite nor singular.
TEST(SparseFactorTest, SolvesIndefiniteSystems) {
  const SparseMatrix A = PlaneWithLinks(12, 0);
  const SparseFactor<double> factor(A, SparseOrder(A), 2.1, 1.0);
  ASSERT_TRUE(factor.is_regular());
  const Vector b = Vector::LinSpaced(A.rows(), -1, 2);
  ExpectSolves(2.1 * Matrix::Identity(A.rows(), A.rows()) - Matrix(A), factor.Solve(b), b);
}

}  // namespace
}  // namespace dlcs
