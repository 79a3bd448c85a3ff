// SPDX-License-Identifier: Apache-2.0

#include "core/linalg/graded_schur.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/linalg/balance.h"
#include "core/linalg/double_double.h"
#include "core/linalg/norms.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;

constexpr double kForever = std::numeric_limits<double>::infinity();

std::vector<double> SortedRealParts(const GradedSchurForm& form) {
  std::vector<double> values;
  for (const std::complex<double>& value : form.triangle.diagonal()) values.push_back(value.real());
  std::sort(values.begin(), values.end());
  return values;
}

Matrix Ladder(Index size, double fast) {
  // Capacitors of 1/fast and 1 in turn, coupled by conductances of one, the last one grounded.
  Matrix A = Matrix::Zero(size, size);
  for (Index i = 0; i < size; ++i) {
    const double rate = i % 2 ? 1 : fast;
    if (i > 0) A(i, i - 1) = rate, A(i, i) -= rate;
    A(i, i) -= rate;
    if (i + 1 < size) A(i, i + 1) = rate;
  }
  return A;
}

Matrix InUnits(const Matrix& A, const std::vector<int>& exponents) {
  Matrix scaled = A;
  for (Index i = 0; i < A.rows(); ++i) {
    for (Index j = 0; j < A.cols(); ++j) scaled(i, j) = std::ldexp(A(i, j), exponents[i] - exponents[j]);
  }
  return scaled;
}

void ExpectForm(const Matrix& A, double tolerance) {
  const auto form = ComputeGradedSchurForm(A, kForever);
  ASSERT_TRUE(form.has_value());
  const Eigen::MatrixXcd identity = Eigen::MatrixXcd::Identity(A.rows(), A.rows());
  EXPECT_LE(MaxAbs(form->inverse * form->vectors - identity), tolerance);
  EXPECT_EQ(MaxAbs(Eigen::MatrixXcd(form->triangle.triangularView<Eigen::StrictlyLower>())), 0);
  // Row by row and column by column, in the units of A.
  const Eigen::MatrixXcd difference = form->vectors * form->triangle * form->inverse - A.cast<std::complex<double>>();
  const Matrix size = form->vectors.cwiseAbs() * form->triangle.cwiseAbs() * form->inverse.cwiseAbs();
  EXPECT_TRUE((difference.cwiseAbs().array() <= tolerance * size.array()).all()) << difference;
}

TEST(GradedSchurTest, IsTheMatrixInItsUnits) {
  const std::vector<int> units = {0, 40, -37, 12, 3, -50, 22, 9};
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Matrix A = RandomMatrix(8, 8, seed);
    ExpectForm(A, 1e-13);
    ExpectForm(InUnits(A, units), 1e-13);
  }
  for (const Index size : {2, 3, 5, 8, 13}) {
    for (const double fast : {1e3, 1e9, 1e14}) ExpectForm(Ladder(size, fast), 1e-13);
  }
}

TEST(GradedSchurTest, LeavesTriangularMatricesToTheBit) {
  Matrix A = RandomMatrix(6, 6, 9).triangularView<Eigen::Upper>();
  A(0, 0) = -1e14;
  A(4, 4) = -1e-3;
  for (const Matrix& triangular : {A, Matrix(A.transpose()), Matrix(Matrix(A.diagonal().asDiagonal()))}) {
    const auto form = ComputeGradedSchurForm(triangular, kForever);
    ASSERT_TRUE(form.has_value());
    EXPECT_EQ(form->vectors * form->triangle * form->inverse, triangular.cast<std::complex<double>>());
    EXPECT_EQ((form->vectors.cwiseAbs().array() > 0).count(), 6);
  }
}

// [-λ, 1; 1, -1]: its slow eigenvalue is -(1 - 1/λ - ...), by the quadratic formula without cancellation.
TEST(GradedSchurTest, KeepsSlowEigenvaluesBesideFastOnes) {
  for (const double fast : {1e3, 1e6, 1e9, 1e12, 1e15}) {
    Matrix A(2, 2);
    A << -fast, 1, 1, -1;
    const double large = -((fast + 1) + std::hypot(fast - 1, 2)) / 2, small = (fast - 1) / large;
    const std::vector<double> values = SortedRealParts(*ComputeGradedSchurForm(A, kForever));
    EXPECT_NEAR(values[0] / large, 1, 1e-15) << fast;
    EXPECT_NEAR(values[1] / small, 1, 1e-15) << fast;
  }
}

// A picofarad beside a microfarad: [-λ, λ; 1, -1 - δ], whose slow eigenvalue is -λδ/|large|.
TEST(GradedSchurTest, KeepsSlowEigenvaluesThatAreDifferencesOfLargeOnes) {
  for (const double fast : {0x1p20, 0x1p30, 0x1p40}) {
    constexpr double kLeak = 0x1p-6;
    Matrix A(2, 2);
    A << -fast, fast, 1, -1 - kLeak;
    const double trace = fast + 1 + kLeak;
    const double large = -(trace + std::sqrt(trace * trace - 4 * fast * kLeak)) / 2, small = fast * kLeak / large;
    const std::vector<double> values = SortedRealParts(*ComputeGradedSchurForm(A, kForever));
    EXPECT_NEAR(values[0] / large, 1, 1e-15) << fast;
    EXPECT_NEAR(values[1] / small, 1, 1e-14) << fast;
  }
}

// The same, where they are only some hundred times slower, and over a hundred of the fast times.
TEST(GradedSchurTest, KeepsSlowEigenvaluesThatAreDifferencesOfModeratelyLargeOnes) {
  constexpr double kLeak = 0x1p-6;
  for (double fast = 80; fast < 200; fast += 3) {
    const Matrix A{{-fast, fast}, {1, -1 - kLeak}};
    const double trace = fast + 1 + kLeak;
    const double large = -(trace + std::sqrt(trace * trace - 4 * fast * kLeak)) / 2, small = fast * kLeak / large;
    for (const double duration : {1.0, kForever}) {
      EXPECT_NEAR(SortedRealParts(*ComputeGradedSchurForm(A, duration))[1] / small, 1, 1e-14) << fast;
    }
  }
}

// The same within one of the fast times.
TEST(GradedSchurTest, KeepsSlowEigenvaluesThatAreDifferencesOfLargeOnesOverShortTimes) {
  constexpr double kLeak = 0x1p-6;
  for (const double fast : {0x1.8p17, 0x1p18, 0x1.8p18}) {
    const Matrix A{{-fast, fast}, {1, -1 - kLeak}};
    const double trace = fast + 1 + kLeak;
    const double large = -(trace + std::sqrt(trace * trace - 4 * fast * kLeak)) / 2, small = fast * kLeak / large;
    EXPECT_NEAR(SortedRealParts(*ComputeGradedSchurForm(A, 1 / fast))[1] / small, 1, 1e-14) << fast;
  }
}

TEST(GradedSchurTest, PutsFastEigenvaluesOfAGradedBlockFirst) {
  const auto form = ComputeGradedSchurForm(Ladder(6, 1e9), kForever);
  for (Index i = 0; i + 1 < 6; ++i)
    EXPECT_GE(2.01 * std::abs(form->triangle(i, i)), std::abs(form->triangle(i + 1, i + 1)));
}

// [-1, 1; c, -2] with a tiny c: the off-diagonal entry of e^A is (e⁻¹ - e⁻²) c, to the last digits.
TEST(GradedSchurTest, KeepsTinyCouplings) {
  constexpr double kCoupling = 1e-20;
  Matrix A(2, 2);
  A << -1, 1, kCoupling, -2;
  const auto form = ComputeGradedSchurForm(A, 1);
  ASSERT_TRUE(form.has_value());
  const Eigen::MatrixXcd& T = form->triangle;
  Eigen::MatrixXcd exponential = T.diagonal().array().exp().matrix().asDiagonal();
  exponential(0, 1) = T(0, 1) * (exponential(0, 0) - exponential(1, 1)) / (T(0, 0) - T(1, 1));
  const Matrix E = (form->vectors * exponential * form->inverse).real();
  EXPECT_NEAR(E(0, 1) / (std::exp(-1) - std::exp(-2)), 1, 1e-14);
  EXPECT_NEAR(E(1, 0) / (kCoupling * (std::exp(-1) - std::exp(-2))), 1, 1e-14);
}

TEST(GradedSchurTest, HasTheSameTriangleInUnitsThatArePowersOfTwo) {
  const std::vector<int> units = {30, -12, 5, 0, -41, 17};
  for (const Matrix& A : {RandomMatrix(6, 6, 21), Ladder(6, 1e9)}) {
    const auto form = ComputeGradedSchurForm(A, kForever), scaled = ComputeGradedSchurForm(InUnits(A, units), kForever);
    EXPECT_EQ(form->triangle, scaled->triangle);
    EXPECT_EQ(32 * form->triangle, ComputeGradedSchurForm(32 * A, kForever)->triangle);
  }
}

TEST(DoubleDoubleTest, HasThirtyDigits) {
  const DoubleDouble third = DoubleDouble(1) / DoubleDouble(3), root = Sqrt(DoubleDouble(2));
  EXPECT_LE(std::abs((third * DoubleDouble(3) - DoubleDouble(1)).high), 1e-31);
  EXPECT_LE(std::abs((root * root - DoubleDouble(2)).high), 1e-31);
  EXPECT_EQ(((DoubleDouble(1) + DoubleDouble(1e-25)) - DoubleDouble(1)).high, 1e-25);
}

}  // namespace
}  // namespace dlcs
