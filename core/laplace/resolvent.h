// SPDX-License-Identifier: Apache-2.0
// (zI - A)⁻¹ for many z and one dense A.

#ifndef DLCS_CORE_LAPLACE_RESOLVENT_H_
#define DLCS_CORE_LAPLACE_RESOLVENT_H_

#include <complex>

#include "core/types.h"

namespace dlcs {

// One complex Schur decomposition A = U T U*, then each resolvent is a triangular solve, O(m²). Since U is unitary this
// is as backward stable as an LU of zI - A, which would cost O(m³) per z. It may also be restricted to an invariant
// subspace (core/laplace/spectrum_split.h): then T is smaller than A, and the coordinates are those of the subspace.
class Resolvent {
 public:
  using ComplexMatrix = Eigen::MatrixXcd;
  using ComplexVector = Eigen::VectorXcd;

  explicit Resolvent(const Matrix& A);
  // The resolvent `from` (zI - T)⁻¹ `to`, with T upper triangular.
  Resolvent(ComplexMatrix to, ComplexMatrix T, ComplexMatrix from);

  // The diagonal of T: the eigenvalues of A.
  ComplexVector Eigenvalues() const { return T_.diagonal(); }

  // U* b and Re(U b): into and out of the coordinates in which Solve() works.
  ComplexVector ToSchur(const ComplexVector& b) const { return to_ * b; }
  Vector FromSchur(const ComplexVector& b) const { return (from_ * b).real(); }

  const ComplexMatrix& to() const { return to_; }      // U*
  const ComplexMatrix& from() const { return from_; }  // U
  const ComplexMatrix& T() const { return T_; }

  // Replaces the columns of b by (zI - T)⁻¹ b. A z that is an eigenvalue gives non-finite entries.
  void Solve(std::complex<double> z, Eigen::Ref<ComplexMatrix> b) const;

  // (zI - A)⁻¹ and its ∞-norm. O(m³).
  ComplexMatrix Inverse(std::complex<double> z) const;
  double Norm(std::complex<double> z) const;

 private:
  ComplexMatrix to_;
  ComplexMatrix T_;
  ComplexMatrix from_;
};

// The largest |arg(-λ)| over the eigenvalues of A, in [0, π]; eigenvalues up to `zero`, or below 1e-14 of the largest,
// count as zero, which lies in every sector.
double SectorAngle(const Eigen::VectorXcd& eigenvalues, double zero = 0);

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_RESOLVENT_H_
