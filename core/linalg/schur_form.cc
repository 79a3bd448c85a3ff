// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/schur_form.h"

#include <Eigen/Householder>
#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>
#include <complex>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/qr_iteration.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

using Complex = std::complex<double>;
using ComplexMatrix = Eigen::MatrixXcd;

double Size(const Complex& z) { return std::abs(z.real()) + std::abs(z.imag()); }

// H := Qᵀ A Q with zeros below the first subdiagonal, and Q.
void ReduceToHessenberg(Matrix& H, Matrix& Q) {
  const Index size = H.rows();
  Q.setIdentity(size, size);
  Vector workspace(size), scale(std::max<Index>(size - 1, 0));
  for (Index i = 0; i + 1 < size; ++i) {
    LookForStop();
    const Index below = size - i - 1;
    double beta = 0;
    H.col(i).tail(below).makeHouseholderInPlace(scale[i], beta);
    H(i + 1, i) = beta;
    const auto essential = H.col(i).tail(below - 1);
    H.bottomRightCorner(below, below).applyHouseholderOnTheLeft(essential, scale[i], workspace.data());
    H.rightCols(below).applyHouseholderOnTheRight(essential, scale[i], workspace.data());
  }
  // The reflections are kept where the zeros belong: Q is made of them from the last to the first.
  for (Index i = size - 2; i >= 0; --i) {
    LookForStop();
    const Index below = size - i - 1;
    const auto essential = H.col(i).tail(below - 1);
    Q.bottomRightCorner(below, below).applyHouseholderOnTheLeft(essential, scale[i], workspace.data());
    H.col(i).tail(below - 1).setZero();
  }
}

// What IterateQr() needs of an upper Hessenberg `T`; `U` takes the rotations too.
class ComplexQr {
 public:
  ComplexQr(ComplexMatrix& T, ComplexMatrix& U) : T_(T), U_(U) {}

  bool CutsOff(Index i) {
    const double beside = Size(T_(i, i)) + Size(T_(i + 1, i + 1));
    if (!(Size(T_(i + 1, i)) <= RoundingOf(2) * beside)) return false;
    T_(i + 1, i) = 0;
    return true;
  }

  // Wilkinson's shift: the eigenvalue of the last 2 × 2 block nearest to its last entry. Now and then another, lest the
  // iteration runs in a circle.
  Complex Shift(Index end, int iteration) const {
    if (iteration == 10 || iteration == 20) {
      return std::abs(T_(end, end - 1).real()) + std::abs(end > 1 ? T_(end - 1, end - 2).real() : 0.0);
    }
    // Scaled to size one, so that nothing overflows.
    const auto block = T_.block<2, 2>(end - 1, end - 1);
    const double scale = block.cwiseAbs().sum();
    const Eigen::Matrix2cd t = block / scale;
    const Complex product = t(0, 1) * t(1, 0), difference = t(0, 0) - t(1, 1);
    const Complex root = std::sqrt(difference * difference + 4.0 * product);
    const Complex determinant = t(0, 0) * t(1, 1) - product, trace = t(0, 0) + t(1, 1);
    Complex one = (trace + root) / 2.0, other = (trace - root) / 2.0;
    // The larger one has lost no digits; the other follows from it.
    if (Size(one) > Size(other)) {
      other = determinant / one;
    } else if (Size(other) > 0) {
      one = determinant / other;
    }
    return scale * (Size(one - t(1, 1)) < Size(other - t(1, 1)) ? one : other);
  }

  void Begin(Index begin, Index end, const Complex& shift) {
    Eigen::JacobiRotation<Complex> rotation;
    rotation.makeGivens(T_(begin, begin) - shift, T_(begin + 1, begin));
    Rotate(rotation, begin, begin, end);
  }

  void Chase(Index i, Index end) {
    Eigen::JacobiRotation<Complex> rotation;
    rotation.makeGivens(T_(i, i - 1), T_(i + 1, i - 1), &T_(i, i - 1));
    T_(i + 1, i - 1) = 0;
    Rotate(rotation, i, i, end);
  }

 private:
  // Rotates the rows i and i + 1 from column `first` on, and the columns i and i + 1 as far down as they reach.
  void Rotate(const Eigen::JacobiRotation<Complex>& rotation, Index i, Index first, Index end) {
    T_.rightCols(T_.cols() - first).applyOnTheLeft(i, i + 1, rotation.adjoint());
    T_.topRows(std::min(i + 2, end) + 1).applyOnTheRight(i, i + 1, rotation);
    U_.applyOnTheRight(i, i + 1, rotation);
  }

  ComplexMatrix& T_;
  ComplexMatrix& U_;
};

}  // namespace

std::optional<SchurForm> ComputeSchurForm(const Matrix& A) {
  if (!A.allFinite()) return std::nullopt;
  Matrix H = A, Q;
  ReduceToHessenberg(H, Q);
  SchurForm form{H.cast<Complex>(), Q.cast<Complex>()};
  constexpr Index kMaxIterations = 30;
  ComplexQr qr(form.triangle, form.vectors);
  if (!IterateQr(A.rows(), kMaxIterations, qr)) return std::nullopt;
  return form;
}

}  // namespace dlcs
