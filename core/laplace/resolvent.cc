// SPDX-License-Identifier: Apache-2.0

#include "core/laplace/resolvent.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"
#include "core/linalg/schur_form.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

Resolvent::Resolvent(const Matrix& A) {
  std::optional<SchurForm> form = ComputeSchurForm(A);
  // Without a Schur form there is no resolvent.
  if (!form) {
    form = SchurForm{ComplexMatrix::Constant(A.rows(), A.cols(), NAN), ComplexMatrix::Identity(A.rows(), A.cols())};
  }
  to_ = form->vectors.adjoint();
  T_ = std::move(form->triangle);
  from_ = std::move(form->vectors);
}

Resolvent::Resolvent(ComplexMatrix to, ComplexMatrix T, ComplexMatrix from)
    : to_(std::move(to)), T_(std::move(T)), from_(std::move(from)) {}

void Resolvent::Solve(std::complex<double> z, Eigen::Ref<ComplexMatrix> b) const {
  for (Index k = 0; k < b.cols(); ++k) {
    LookForStop();
    auto column = b.col(k);
    for (Index j = b.rows() - 1; j >= 0; --j) {
      column[j] /= z - T_(j, j);
      column.head(j).noalias() += column[j] * T_.col(j).head(j);
    }
  }
}

Resolvent::ComplexMatrix Resolvent::Inverse(std::complex<double> z) const {
  ComplexMatrix columns = to_;
  Solve(z, columns);
  ComplexMatrix inverse(from_.rows(), columns.cols());
  ForPanels(columns.cols(), 4 * from_.size(), [&](Index begin, Index count) {
    inverse.middleCols(begin, count).noalias() = from_ * columns.middleCols(begin, count);
  });
  return inverse;
}

double Resolvent::Norm(std::complex<double> z) const { return InfinityNorm(Inverse(z)); }

double SectorAngle(const Eigen::VectorXcd& eigenvalues, double zero) {
  if (eigenvalues.size() == 0) return 0;
  zero = std::max(zero, 1e-14 * eigenvalues.cwiseAbs().maxCoeff());
  double angle = 0;
  for (const std::complex<double>& lambda : eigenvalues) {
    if (std::abs(lambda) > zero) angle = std::max(angle, std::abs(std::arg(-lambda)));
  }
  return angle;
}

}  // namespace dlcs
