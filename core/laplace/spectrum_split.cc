// SPDX-License-Identifier: Apache-2.0
#include "core/laplace/spectrum_split.h"

#include <Eigen/Jacobi>
#include <utility>

#include "core/linalg/decompositions.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

using Complex = std::complex<double>;
using ComplexMatrix = Eigen::MatrixXcd;

// Exchanges the eigenvalues j and j + 1 of U T U* by a rotation of the plane.
void Exchange(Index j, ComplexMatrix& T, ComplexMatrix& U) {
  LookForStop();
  Eigen::JacobiRotation<Complex> rotation;
  rotation.makeGivens(T(j, j + 1), T(j + 1, j + 1) - T(j, j));
  T.applyOnTheLeft(j, j + 1, rotation.adjoint());
  T.applyOnTheRight(j, j + 1, rotation);
  U.applyOnTheRight(j, j + 1, rotation);
  T(j + 1, j) = 0;
}

// Brings the eigenvalues outside to the front; returns how many.
Index Order(const std::function<bool(Complex)>& is_outside, ComplexMatrix& T, ComplexMatrix& U) {
  Index front = 0;
  for (Index j = 0; j < T.rows(); ++j) {
    if (!is_outside(T(j, j))) continue;
    for (Index k = j; k > front; --k) Exchange(k - 1, T, U);
    ++front;
  }
  return front;
}

// Y with T11 Y - Y T22 = -T12: the invariant subspace of T22 is spanned by (Y, I).
ComplexMatrix SolveSylvester(const ComplexMatrix& T, Index front) {
  const Index back = T.rows() - front;
  ComplexMatrix Y = -T.topRightCorner(front, back);
  for (Index j = 0; j < back; ++j) {
    LookForStop();
    Y.col(j) += Y.leftCols(j) * T.col(front + j).segment(front, j);
    for (Index i = front - 1; i >= 0; --i) {
      Y(i, j) /= T(i, i) - T(front + j, front + j);
      Y.col(j).head(i) -= Y(i, j) * T.col(i).head(i);
    }
  }
  return Y;
}

SpectrumSplit AllOutside(const Matrix& A, double condition) {
  const Matrix identity = Matrix::Identity(A.rows(), A.cols());
  return {.inside = Resolvent(ComplexMatrix(0, A.rows()), ComplexMatrix(0, 0), ComplexMatrix(A.rows(), 0)),
          .basis = identity,
          .outside = A,
          .left = identity,
          .condition = condition};
}

}  // namespace

SpectrumSplit SplitSpectrum(const Matrix& A, const std::function<bool(Complex)>& is_outside) {
  const Resolvent whole(A);
  const Index m = A.rows();
  ComplexMatrix T = whole.T(), U = whole.from();
  const Index front = Order(is_outside, T, U);
  if (front == 0) return {.inside = whole, .basis = Matrix(m, 0), .outside = Matrix(0, 0), .left = Matrix(0, m)};
  if (front == m) return AllOutside(A, 1);

  const ComplexMatrix Y = SolveSylvester(T, front);
  const ComplexMatrix to_front = U.leftCols(front).adjoint() - Y * U.rightCols(m - front).adjoint();
  const ComplexMatrix projector = U.leftCols(front) * to_front;
  const double condition = projector.norm();
  const bool is_real = projector.imag().norm() <= 1e-8 * condition;
  if (!is_real || !(condition <= kWorstCondition)) return AllOutside(A, condition);

  // Orthonormal columns for the range of the (real) projector.
  const Eigen::ColPivHouseholderQR<Matrix> qr(projector.real());
  const Matrix basis = Matrix(qr.householderQ()).leftCols(front);
  return {.inside = Resolvent(U.rightCols(m - front).adjoint(), T.bottomRightCorner(m - front, m - front),
                              U.leftCols(front) * Y + U.rightCols(m - front)),
          .basis = basis,
          .outside = basis.transpose() * A * basis,
          .left = basis.transpose() * projector.real(),
          .condition = condition};
}

}  // namespace dlcs
