// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/scaled_lcp.h"

#include <algorithm>
#include <cmath>

#include "core/analysis/equilibration.h"

namespace dlcs {

ScaledMatrix::ScaledMatrix(const Matrix& original)
    : scale(SymmetricEquilibration(original)),
      M(scale.asDiagonal() * original * scale.asDiagonal()),
      row_sum(M.cwiseAbs().rowwise().sum()),
      band(BandwidthOf(original)),
      original_norm(original.size() == 0 ? 0 : original.cwiseAbs().rowwise().sum().maxCoeff()) {}

ScaledLcp::ScaledLcp(const Matrix& original)
    : matrix(std::make_shared<const ScaledMatrix>(original)),
      q(Vector::Zero(original.rows())),
      tolerance(Vector::Zero(original.rows())) {}

bool ScaledLcp::Load(const Eigen::Ref<const Vector>& original_q,
                     const Eigen::Ref<const Vector>& original_tolerance) {
  bool finite = true;
  original_q_norm = 0;
  for (Index i = 0; i < q.size(); ++i) {
    const double entry = original_q[i];
    finite = finite && std::isfinite(entry);
    original_q_norm = std::max(original_q_norm, std::abs(entry));
    q[i] = matrix->scale[i] * entry;
    tolerance[i] = matrix->scale[i] * original_tolerance[i];
  }
  return finite;
}

}  // namespace dlcs
