// SPDX-License-Identifier: Apache-2.0

#include "core/laplace/resolvent.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/linalg/norms.h"

namespace dlcs {

Resolvent::Resolvent(const Matrix& A) {
  const Eigen::ComplexSchur<Matrix> schur(A);
  U_ = schur.matrixU();
  T_ = schur.matrixT();
}

void Resolvent::Solve(std::complex<double> z, ComplexVector& b) const {
  for (Index j = b.size() - 1; j >= 0; --j) {
    b[j] /= z - T_(j, j);
    b.head(j).noalias() += b[j] * T_.col(j).head(j);
  }
}

Resolvent::ComplexMatrix Resolvent::Inverse(std::complex<double> z) const {
  const Index m = T_.rows();
  ComplexMatrix inverse(m, m);
  for (Index k = 0; k < m; ++k) {
    ComplexVector column = U_.adjoint().col(k);
    Solve(z, column);
    inverse.col(k) = U_ * column;
  }
  return inverse;
}

double Resolvent::Norm(std::complex<double> z) const { return InfinityNorm(Inverse(z)); }

double SectorAngle(const Eigen::VectorXcd& eigenvalues) {
  if (eigenvalues.size() == 0) return 0;
  const double largest = eigenvalues.cwiseAbs().maxCoeff();
  double angle = 0;
  for (const std::complex<double>& lambda : eigenvalues) {
    if (std::abs(lambda) > 1e-14 * largest) angle = std::max(angle, std::abs(std::arg(-lambda)));
  }
  return angle;
}

}  // namespace dlcs
