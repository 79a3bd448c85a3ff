// SPDX-License-Identifier: Apache-2.0

#include "core/linalg/schur_form.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <vector>

#include "core/linalg/norms.h"
#include "core/linalg/symmetric_eigenvalues.h"
#include "core/parallel/stop_scope.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;

Matrix Jordan(Index size, double eigenvalue) {
  Matrix A = eigenvalue * Matrix::Identity(size, size);
  A.diagonal(1).setOnes();
  return A;
}

// A permutation in a circle: the eigenvalues are the roots of one, and QR without shifts never gets on.
Matrix Circle(Index size) {
  Matrix A = Matrix::Zero(size, size);
  for (Index i = 0; i < size; ++i) A((i + 1) % size, i) = 1;
  return A;
}

std::vector<Matrix> Examples() {
  std::vector<Matrix> examples = {Matrix::Zero(4, 4),
                                  Matrix::Identity(5, 5),
                                  Jordan(6, 0),
                                  Jordan(12, -2),
                                  Circle(7),
                                  Circle(40),
                                  RandomMatrix(1, 1, 1),
                                  RandomMatrix(2, 2, 2),
                                  RandomMatrix(30, 30, 3),
                                  RandomMatrix(120, 120, 4)};
  const Matrix scattered = RandomMatrix(20, 20, 5);
  examples.push_back(scattered - scattered.transpose());
  examples.push_back(1e150 * scattered);
  examples.push_back(1e-150 * scattered);
  examples.push_back(Vector::LinSpaced(20, -8, 8).unaryExpr([](double x) { return std::pow(10, x); }).asDiagonal() *
                     scattered);
  return examples;
}

TEST(SchurFormTest, IsUnitaryTriangularAndTheMatrix) {
  for (const Matrix& A : Examples()) {
    const auto form = ComputeSchurForm(A);
    ASSERT_TRUE(form.has_value());
    const double size = static_cast<double>(A.rows());
    const Eigen::MatrixXcd& U = form->vectors;
    EXPECT_LE(MaxAbs(U.adjoint() * U - Eigen::MatrixXcd::Identity(A.rows(), A.rows())), 1e-14 * size);
    EXPECT_EQ(MaxAbs(Eigen::MatrixXcd(form->triangle.triangularView<Eigen::StrictlyLower>())), 0);
    EXPECT_LE(MaxAbs(U * form->triangle * U.adjoint() - A.cast<std::complex<double>>()), 1e-14 * size * A.norm());
  }
}

TEST(SchurFormTest, HasTheEigenvaluesThatEigenFinds) {
  const Matrix A = RandomMatrix(50, 50, 6);
  const Eigen::VectorXcd expected = Eigen::EigenSolver<Matrix>(A, false).eigenvalues();
  const Eigen::VectorXcd found = ComputeSchurForm(A)->triangle.diagonal();
  for (const std::complex<double>& value : expected) EXPECT_LE((found.array() - value).abs().minCoeff(), 1e-11);
}

TEST(SchurFormTest, IsAbsentWhereAnEntryIsNotFinite) {
  Matrix A = RandomMatrix(4, 4, 7);
  A(2, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(ComputeSchurForm(A).has_value());
}

TEST(SymmetricEigenvaluesTest, AreThoseThatEigenFinds) {
  for (const Matrix& A : Examples()) {
    const Matrix symmetric = A + A.transpose();
    const Vector expected = Eigen::SelfAdjointEigenSolver<Matrix>(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
    EXPECT_LE(MaxAbs(SymmetricEigenvalues(symmetric) - expected),
              1e-14 * static_cast<double>(A.rows()) * symmetric.norm());
  }
}

TEST(SchurFormTest, Stops) {
  std::stop_source stop;
  stop.request_stop();
  const StopScope scope(stop.get_token());
  EXPECT_THROW(ComputeSchurForm(RandomMatrix(20, 20, 8)), Stopped);
  EXPECT_THROW(SymmetricEigenvalues(Matrix::Ones(20, 20)), Stopped);
}

}  // namespace
}  // namespace dlcs
