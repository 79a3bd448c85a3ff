// SPDX-License-Identifier: Apache-2.0
// (zI - A)⁻¹ for many z and one dense A.

#ifndef DLCS_CORE_LAPLACE_RESOLVENT_H_
#define DLCS_CORE_LAPLACE_RESOLVENT_H_

#include <complex>

#include "core/types.h"

namespace dlcs {

// One complex Schur decomposition A = U T U*, then each resolvent is a triangular solve, O(m²). Unitary, so as
// backward stable as an LU of zI - A, which would cost O(m³) per z.
class Resolvent {
 public:
  using ComplexMatrix = Eigen::MatrixXcd;
  using ComplexVector = Eigen::VectorXcd;

  explicit Resolvent(const Matrix& A);

  // The eigenvalues of A.
  ComplexVector Eigenvalues() const { return T_.diagonal(); }

  // U* b and Re(U b): into and out of the coordinates in which Solve() works.
  ComplexVector ToSchur(const ComplexVector& b) const { return U_.adjoint() * b; }
  Vector FromSchur(const ComplexVector& b) const { return (U_ * b).real(); }

  // Replaces b by (zI - T)⁻¹ b. A z that is an eigenvalue gives non-finite entries.
  void Solve(std::complex<double> z, ComplexVector& b) const;

  // (zI - A)⁻¹ and its ∞-norm. O(m³).
  ComplexMatrix Inverse(std::complex<double> z) const;
  double Norm(std::complex<double> z) const;

 private:
  ComplexMatrix U_;
  ComplexMatrix T_;
};

// The largest |arg(-λ)| over the eigenvalues of A, in [0, π]; eigenvalues below 1e-14 of the largest count as zero,
// which lies in every sector.
double SectorAngle(const Eigen::VectorXcd& eigenvalues);

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_RESOLVENT_H_
