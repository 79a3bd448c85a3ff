// SPDX-License-Identifier: Apache-2.0

#include "core/linalg/bounded_sum.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "core/linalg/structured_matrix.h"

namespace dlcs {
namespace {

using Exact = boost::multiprecision::cpp_rational;

constexpr double kUnitRoundoff = 0x1p-53;
constexpr Index kDimensions[] = {1, 2, 3, 10, 57, 200};

// Numbers whose sizes and signs differ, so that sums lose digits and terms cancel.
class Numbers {
 public:
  explicit Numbers(unsigned seed) : generator_(seed) {}

  double Next() { return std::ldexp(uniform_(generator_), exponent_(generator_)); }
  Matrix NextMatrix(Index rows, Index columns) {
    return Matrix::NullaryExpr(rows, columns, [this] { return Next(); });
  }
  Vector NextVector(Index size) { return NextMatrix(size, 1); }

 private:
  std::mt19937_64 generator_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
  std::uniform_int_distribution<int> exponent_{-20, 20};
};

Exact Abs(const Exact& value) { return value < 0 ? Exact(-value) : value; }

// c + Σ a_j x_j and the sum of the absolute values of its terms.
struct ExactSum {
  ExactSum(const Eigen::RowVectorXd& a, const Vector& x, double c) : value(c), terms(std::abs(c)) {
    for (Index j = 0; j < x.size(); ++j) {
      const Exact term = Exact(a[j]) * Exact(x[j]);
      value += term;
      terms += Abs(term);
    }
  }
  Exact value, terms;
};

TEST(BoundedSumTest, EachOperationCountsOnce) {
  EXPECT_EQ(RoundingOf(0), 0);
  EXPECT_EQ(RoundingOf(1), kUnitRoundoff);
  EXPECT_EQ(RoundingOf(1000), 1000 * kUnitRoundoff);
}

TEST(BoundedSumTest, EnclosesSumsOfNumbers) {
  Numbers numbers(1);
  for (const Index n : kDimensions) {
    BoundedSum sum;
    Exact exact = 0, terms = 0;
    for (Index k = 0; k < n; ++k) {
      const double term = numbers.Next();
      sum.Add(term);
      exact += Exact(term);
      terms += Abs(Exact(term));
    }
    EXPECT_LE(Abs(Exact(sum.value) - exact), Exact(RoundingOf(n - 1)) * terms) << n;
    EXPECT_LE(Abs(Exact(sum.value) - exact), Exact(sum.Rounding(2 * n))) << n;
  }
}

TEST(BoundedSumTest, BoundIsAttained) {
  BoundedSum sum;
  sum.Add(1);
  sum.Add(kUnitRoundoff);  // half of the last place of 1: the even neighbor is 1
  EXPECT_EQ(sum.value, 1);
  EXPECT_GE(Exact(kUnitRoundoff), Exact(0.999) * Exact(sum.Rounding(1)));
}

TEST(BoundedSumTest, TellsSignsThatAreCertain) {
  BoundedSum sum;
  for (const double term : {1.0, 0x1p-60, -1.0}) sum.Add(term);
  EXPECT_EQ(sum.value, 0);  // and 2⁻⁶⁰ exactly
  EXPECT_TRUE(sum.IsZero(2));
  EXPECT_EQ(sum.Sign(2), 0);
  sum.Add(-1e-10);
  EXPECT_FALSE(sum.IsZero(3));
  EXPECT_EQ(sum.Sign(3), -1);
  sum.Add(1);
  EXPECT_EQ(sum.Sign(4), 1);
  sum.Add(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(sum.IsZero(5));
  EXPECT_EQ(sum.Sign(5), 0);
}

TEST(BoundedSumTest, EnclosesProducts) {
  Numbers numbers(2);
  for (const Index n : kDimensions) {
    const Matrix A = numbers.NextMatrix(7, n);
    const Vector x = numbers.NextVector(n), c = numbers.NextVector(7);
    const SparseMatrix sparse = A.sparseView();
    const auto with_c = BoundedProduct(A, x, c), without_c = BoundedProduct(A, x),
               by_sparse = BoundedProduct(sparse, x);
    for (Index i = 0; i < 7; ++i) {
      const ExactSum sum(A.row(i), x, c[i]), product(A.row(i), x, 0);
      EXPECT_LE(Abs(Exact(with_c.value[i]) - sum.value), Exact(RoundingOf(n + 1)) * sum.terms) << n;
      EXPECT_LE(Abs(Exact(with_c.value[i]) - sum.value), Exact(RoundingOfProduct(n) * with_c.terms[i])) << n;
      EXPECT_LE(Abs(Exact(without_c.value[i]) - product.value), Exact(RoundingOf(n)) * product.terms) << n;
      EXPECT_LE(Abs(Exact(by_sparse.value[i]) - product.value), Exact(RoundingOf(n)) * product.terms) << n;
      EXPECT_LE(Abs(Exact(with_c.terms[i]) - sum.terms), Exact(RoundingOf(n + 1)) * sum.terms) << n;
    }
  }
}

TEST(BoundedSumTest, EnclosesProductsOfTwoMatrices) {
  Numbers numbers(3);
  for (const Index n : {1, 5, 40}) {
    const Index m = 2 * n;
    const Matrix A = numbers.NextMatrix(m, n), B = numbers.NextMatrix(3, m);
    const Vector x = numbers.NextVector(n), inner = A * x, computed = B * inner;
    for (Index i = 0; i < 3; ++i) {
      Exact exact = 0, terms = 0;
      for (Index k = 0; k < m; ++k) {
        const ExactSum sum(A.row(k), x, 0);
        exact += Exact(B(i, k)) * sum.value;
        terms += Abs(Exact(B(i, k))) * sum.terms;
      }
      EXPECT_LE(Abs(Exact(computed[i]) - exact), Exact(RoundingOf(n + m)) * terms) << n;
    }
  }
}

TEST(BoundedSumTest, EnclosesResidualsOfSolves) {
  Numbers numbers(4);
  for (const Index n : {1, 2, 5, 30}) {
    const Matrix A = numbers.NextMatrix(n, n);
    const Vector b = numbers.NextVector(n);
    const Eigen::PartialPivLU<Matrix> lu(A);
    const Vector x = lu.solve(b);
    Matrix L = lu.matrixLU().triangularView<Eigen::UnitLower>();
    const Matrix U = lu.matrixLU().triangularView<Eigen::Upper>();
    for (Index i = 0; i < n; ++i) {
      const Index row = lu.permutationP().indices()[i];  // of L, for row i of A
      Exact terms = 0;
      for (Index j = 0; j < n; ++j) {
        for (Index k = 0; k < n; ++k) terms += Abs(Exact(L(row, k)) * Exact(U(k, j)) * Exact(x[j]));
      }
      const ExactSum residual(A.row(i), x, -b[i]);
      EXPECT_LE(Abs(residual.value), Exact(RoundingOf(3 * n)) * terms) << n << " " << i;
    }
  }
}

TEST(BoundedSumTest, CutsWhatIsRounding) {
  const BoundedSums<Vector> sums{Vector{{1e-15, -1e-3, 0.0, 5.0}}, Vector{{10.0, 1.0, 0.0, 5.0}}};
  EXPECT_EQ(sums.WithoutRounding(1e-13), (Vector{{0.0, -1e-3, 0.0, 5.0}}));
  EXPECT_FALSE(sums.AllPositive(1e-13));
  EXPECT_FALSE(sums.NoneNegative(1e-13));
  const BoundedSums<Vector> positive{Vector{{1.0, 2.0}}, Vector{{1.0, 2.0}}}, negative{-positive.value, positive.terms};
  EXPECT_TRUE(positive.AllPositive(0.5));
  EXPECT_FALSE(positive.AllPositive(1));
  EXPECT_TRUE(negative.AllNegative(0.5));
  EXPECT_FALSE(negative.AllNegative(1));
  const BoundedSums<Vector> zero{Vector{{0.0, -1e-16}}, Vector{{0.0, 1.0}}};
  EXPECT_TRUE(zero.NoneNegative(1e-15));
  const BoundedSums<Vector> no_numbers{Vector{{std::numeric_limits<double>::quiet_NaN()}}, Vector{{1.0}}};
  EXPECT_FALSE(no_numbers.AllPositive(0) || no_numbers.AllNegative(0) || no_numbers.NoneNegative(0));
}

}  // namespace
}  // namespace dlcs
