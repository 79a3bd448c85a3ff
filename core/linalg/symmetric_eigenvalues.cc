// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/symmetric_eigenvalues.h"

#include <limits>

#include "core/linalg/decompositions.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

Vector SymmetricEigenvalues(const Matrix& matrix) {
  const Index size = matrix.rows();
  const double scale = MaxAbs(matrix);
  if (!(scale <= std::numeric_limits<double>::max())) {
    return Vector::Constant(size, std::numeric_limits<double>::quiet_NaN());
  }
  if (scale == 0) return Vector::Zero(size);
  Matrix rest = matrix / scale;
  Vector subdiagonal(std::max<Index>(size - 1, 0)), product(size);
  for (Index i = 0; i + 1 < size; ++i) {
    LookForStop();
    // P = I - factor v vᵀ takes the column below the diagonal to (beta, 0, ..., 0); the rest becomes P rest P, a change
    // of rank two.
    const Index below = size - i - 1;
    auto v = rest.col(i).tail(below);
    double factor = 0;
    v.makeHouseholderInPlace(factor, subdiagonal[i]);
    v[0] = 1;
    auto corner = rest.bottomRightCorner(below, below);
    auto w = product.tail(below);
    w.noalias() = corner.selfadjointView<Eigen::Lower>() * (factor * v);
    w -= factor / 2 * w.dot(v) * v;
    corner.selfadjointView<Eigen::Lower>().rankUpdate(v, w, -1);
  }
  Eigen::SelfAdjointEigenSolver<Matrix> solver;
  solver.computeFromTridiagonal(rest.diagonal(), subdiagonal, Eigen::EigenvaluesOnly);
  return scale * solver.eigenvalues();
}

}  // namespace dlcs
