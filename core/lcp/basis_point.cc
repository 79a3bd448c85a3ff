// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis_point.h"

#include <algorithm>
#include <cmath>

#include "core/linalg/elimination_loops.h"

namespace dlcs {

BasisPoint::BasisPoint(const ScaledLcp& lcp, Elimination elimination)
    : factor_(lcp.M(), elimination), y_(lcp.size()), correction_(lcp.size()), w_(lcp.size()), allowed_(lcp.size()) {
  violations_.reserve(lcp.size());
}

bool BasisPoint::Compute(const ScaledLcp& lcp, const Basis& basis) {
  violations_.clear();
  accurate_ = false;
  if (!factor_.Factor(lcp.M(), basis)) return false;
  const std::vector<Index>& S = indices();
  const Index size = static_cast<Index>(S.size());
  for (Index p = 0; p < size; ++p) y_[p] = -lcp.q[S[p]];
  factor_.Solve(y_.head(size));
  if (!Evaluate(lcp)) return false;
  if (!accurate_) {
    for (Index p = 0; p < size; ++p) correction_[p] = w_[S[p]];
    factor_.Solve(correction_.head(size));
    y_.head(size) -= correction_.head(size);
    if (!Evaluate(lcp)) return false;
  }
  FindViolations(
      basis, y_, w_, allowed_, [&](Index i, double value) { return Negligible(lcp, i, value); }, violations_);
  return true;
}

bool BasisPoint::Evaluate(const ScaledLcp& lcp) {
  constexpr double kRowRounding = 1e-14;
  constexpr double kNormRounding = 5e-13;
  const std::vector<Index>& S = indices();
  const auto& [scale, M, row_sum, band, norm] = *lcp.matrix;
  const Index n = lcp.size();
  double scaled_norm = 0;
  double original_norm = 0;
  double sum = 0;  // finite only if every entry is, unlike the maxima
  for (std::size_t p = 0; p < S.size(); ++p) {
    const Index j = S[p];
    const double value = y_[p];
    sum += std::abs(value);
    scaled_norm = std::max(scaled_norm, std::abs(value));
    original_norm = std::max(original_norm, scale[j] * std::abs(value));
  }
  if (!std::isfinite(sum)) return false;
  w_ = lcp.q;
  if (std::min(band.below, band.above) >= n - 1) {
    AddColumns(n, S, y_.data(), M.data(), w_.data());
  } else {
    for (std::size_t p = 0; p < S.size(); ++p) {
      const Index j = S[p];
      const Index last = std::min(n - 1, j + band.below);
      const Index first = std::max<Index>(0, j - band.above);
      SubtractMultiple(last + 1 - first, -y_[p], &M(first, j), &w_[first]);
    }
  }
  const double cap = kNormRounding * (lcp.original_q_norm + norm * original_norm);
  for (Index i = 0; i < n; ++i) {
    const double rounding = kRowRounding * (std::abs(lcp.q[i]) + row_sum[i] * scaled_norm);
    allowed_[i] = lcp.tolerance[i] + std::min(rounding, scale[i] * cap);
  }
  accurate_ = true;
  for (const Index i : S) accurate_ = accurate_ && std::abs(w_[i]) <= allowed_[i];
  return true;
}

bool BasisPoint::Negligible(const ScaledLcp& lcp, Index j, double value) const {
  const Matrix& M = lcp.M();
  const Bandwidth& band = lcp.matrix->band;
  const Index last = std::min(lcp.size() - 1, j + band.below);
  for (Index i = std::max<Index>(0, j - band.above); i <= last; ++i) {
    if (std::abs(M(i, j) * value) > allowed_[i]) return false;
  }
  return true;
}

void BasisPoint::Write(const ScaledLcp& lcp, Eigen::Ref<Vector> y) const {
  y.setZero();
  const std::vector<Index>& S = indices();
  for (std::size_t p = 0; p < S.size(); ++p) y[S[p]] = lcp.matrix->scale[S[p]] * std::max(0.0, y_[p]);
}

}  // namespace dlcs
