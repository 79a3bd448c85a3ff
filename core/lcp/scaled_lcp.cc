// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/scaled_lcp.h"

#include <algorithm>
#include <cmath>

#include "core/analysis/equilibration.h"

namespace dlcs {

ScaledLcp::ScaledLcp(const Matrix& original)
    : scale(SymmetricEquilibration(original)),
      M(scale.asDiagonal() * original * scale.asDiagonal()),
      row_sum(M.cwiseAbs().rowwise().sum()),
      band_below(0),
      band_above(0),
      original_norm(original.size() == 0 ? 0 : original.cwiseAbs().rowwise().sum().maxCoeff()),
      q(Vector::Zero(original.rows())),
      tolerance(Vector::Zero(original.rows())) {
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      if (M(i, j) == 0) continue;
      band_below = std::max(band_below, i - j);
      band_above = std::max(band_above, j - i);
    }
  }
}

bool ScaledLcp::Load(const Eigen::Ref<const Vector>& original_q, const Eigen::Ref<const Vector>& original_tolerance) {
  bool finite = true;
  original_q_norm = 0;
  for (Index i = 0; i < q.size(); ++i) {
    const double entry = original_q[i];
    finite = finite && std::isfinite(entry);
    original_q_norm = std::max(original_q_norm, std::abs(entry));
    q[i] = scale[i] * entry;
    tolerance[i] = scale[i] * original_tolerance[i];
  }
  return finite;
}

}  // namespace dlcs
