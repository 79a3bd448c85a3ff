// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis/scaled_lcp.h"

#include <cmath>

namespace dlcs {

ScaledMatrix::ScaledMatrix(const Matrix& original)
    : scale(EquilibrateRowsAndColumns(original)), M(Scaled(original, scale)), band(BandwidthOf(original)) {}

ScaledLcp::ScaledLcp(const Matrix& original)
    : matrix(std::make_shared<const ScaledMatrix>(original)),
      q(Vector::Zero(original.rows())),
      tolerance(Vector::Zero(original.rows())) {}

bool ScaledLcp::Load(const Eigen::Ref<const Vector>& original_q, const Eigen::Ref<const Vector>& original_tolerance) {
  bool finite = true;
  for (Index i = 0; i < q.size(); ++i) {
    const double entry = original_q[i], scale = matrix->scale.row[i];
    finite = finite && std::isfinite(entry);
    q[i] = scale * entry;
    tolerance[i] = scale * original_tolerance[i];
  }
  return finite;
}

}  // namespace dlcs
