// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis/basis_point.h"

#include <algorithm>
#include <cmath>

#include "core/lcp/basis/tolerance.h"
#include "core/linalg/simd/elimination_loops.h"

namespace dlcs {

BasisPoint::BasisPoint(const ScaledLcp& lcp, Elimination elimination)
    : factor_(lcp.M(), elimination),
      y_(lcp.size()),
      other_(lcp.size()),
      w_(lcp.size()),
      allowed_(lcp.size()),
      is_summed_(lcp.size()) {
  violations_.reserve(lcp.size());
}

bool BasisPoint::Compute(const ScaledLcp& lcp, const Basis& basis) {
  constexpr int kRefinements = 3;
  violations_.clear();
  accurate_ = false;
  if (!factor_.Factor(lcp.M(), basis)) return false;
  const std::vector<Index>& S = indices();
  const Index size = static_cast<Index>(S.size());
  for (Index p = 0; p < size; ++p) y_[p] = -lcp.q[S[p]];
  factor_.Solve(y_.head(size));
  if (!Evaluate(lcp)) return false;
  for (int k = 0; k < kRefinements && !accurate_; ++k) {
    for (Index p = 0; p < size; ++p) other_[p] = w_[S[p]];
    factor_.Solve(other_.head(size));
    y_.head(size) -= other_.head(size);
    if (!Evaluate(lcp)) return false;
  }
  FindOwnViolations(lcp, basis);
  if (!solved() && size > 0) CutNoise(lcp, basis);
  return true;
}

void BasisPoint::FindOwnViolations(const ScaledLcp& lcp, const Basis& basis) {
  violations_.clear();
  for (Index i = 0; i < lcp.size(); ++i) {
    if (!basis[i] && w_[i] < -allowed_[i]) Allowed(lcp, i);
  }
  FindViolations(
      basis, y_, w_, allowed_, [&](Index i, double value) { return Negligible(lcp, i, value); }, violations_);
}

bool BasisPoint::Evaluate(const ScaledLcp& lcp) {
  const std::vector<Index>& S = indices();
  const Matrix& M = lcp.M();
  const Bandwidth& band = lcp.matrix->band;
  const Index n = lcp.size();
  double sum = 0;  // finite only if every entry is, unlike the maxima
  for (std::size_t p = 0; p < S.size(); ++p) sum += std::abs(y_[static_cast<Index>(p)]);
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
  const double underflow = UnderflowIn(static_cast<Index>(S.size()));
  for (Index i = 0; i < n; ++i) allowed_[i] = underflow + lcp.tolerance[i] + kRowRounding * std::abs(lcp.q[i]);
  std::fill(is_summed_.begin(), is_summed_.end(), std::uint8_t{0});
  accurate_ = true;
  for (std::size_t p = 0; p < S.size() && accurate_; ++p) {
    const double miss = y_[static_cast<Index>(p)] == 0 ? -w_[S[p]] : std::abs(w_[S[p]]);
    accurate_ = miss <= allowed_[S[p]] || miss <= Allowed(lcp, S[p]);
  }
  return true;
}

double BasisPoint::Allowed(const ScaledLcp& lcp, Index i) {
  if (is_summed_[i]) return allowed_[i];
  is_summed_[i] = 1;
  return allowed_[i] += kRowRounding * SizeOfProduct(lcp, i);
}

double BasisPoint::SizeOfProduct(const ScaledLcp& lcp, Index i) const {
  const std::vector<Index>& S = indices();
  double size = 0;
  for (std::size_t p = 0; p < S.size(); ++p) size += std::abs(lcp.M()(i, S[p]) * y_[static_cast<Index>(p)]);
  return size;
}

bool BasisPoint::Negligible(const ScaledLcp& lcp, Index j, double value) {
  const Matrix& M = lcp.M();
  const Bandwidth& band = lcp.matrix->band;
  const Index last = std::min(lcp.size() - 1, j + band.below);
  for (Index i = std::max<Index>(0, j - band.above); i <= last; ++i) {
    const double change = std::abs(M(i, j) * value);
    if (change > allowed_[i] && change > Allowed(lcp, i)) return false;
  }
  return true;
}

// Whether all violations are small: those of y_S at most `part` of these sizes, those of w_i at most `part` of the
// terms that y of these sizes gives.
bool BasisPoint::AreViolationsWithin(const ScaledLcp& lcp, const Basis& basis, double part,
                                     const Vector& size_of_y) const {
  const std::vector<Index>& S = indices();
  for (const Index i : violations_) {
    if (basis[i]) {
      const Index p = std::lower_bound(S.begin(), S.end(), i) - S.begin();
      if (std::abs(y_[p]) > part * size_of_y[p]) return false;
    } else {
      double size = std::abs(lcp.q[i]);
      for (std::size_t p = 0; p < S.size(); ++p) size += std::abs(lcp.M()(i, S[p])) * size_of_y[static_cast<Index>(p)];
      if (std::abs(w_[i]) > part * size) return false;
    }
  }
  return true;
}

// If y_j = 0 for an index of S, rounding leaves a small number of either sign. A row without other terms would take it
// for a real value. So all entries that may be zero are set to zero, and the result is judged like any other point.
void BasisPoint::CutNoise(const ScaledLcp& lcp, const Basis& basis) {
  const Index size = static_cast<Index>(indices().size());
  const double most = y_.head(size).cwiseAbs().maxCoeff();
  const double noise = kMaybeZero * most;
  if (!AreViolationsWithin(lcp, basis, kMaybeZero, Vector::Constant(size, most))) return;
  if (!(y_.head(size).array() != 0 && y_.head(size).array().abs() <= noise).any()) return;
  other_.head(size) = y_.head(size);
  y_.head(size) = (y_.head(size).array().abs() <= noise).select(0, y_.head(size));
  const std::vector<Index> before = violations_;
  const bool accurate_before = accurate_;
  if (Evaluate(lcp)) FindOwnViolations(lcp, basis);
  if (solved()) return;
  y_.head(size) = other_.head(size);
  Evaluate(lcp);
  violations_ = before;
  accurate_ = accurate_before;
}

bool BasisPoint::IsDoubtful(const ScaledLcp& lcp, const Basis& basis) {
  const Index size = static_cast<Index>(indices().size());
  if (size == 0) return false;
  const double most = y_.head(size).cwiseAbs().maxCoeff();
  return AreViolationsWithin(lcp, basis, kMaybeZero, Vector::Constant(size, most)) && AreWithinRounding(lcp, basis);
}

bool BasisPoint::AreWithinRounding(const ScaledLcp& lcp, const Basis& basis) {
  const std::vector<Index>& S = indices();
  const Index size = static_cast<Index>(S.size());
  if (size == 0) return false;
  Vector size_of_y = Vector::Zero(size);
  Vector column(size);
  for (Index p = 0; p < size; ++p) {
    column = Vector::Unit(size, p);
    factor_.Solve(column);
    size_of_y += column.cwiseAbs() * (std::abs(lcp.q[S[p]]) + SizeOfProduct(lcp, S[p]));
  }
  return AreViolationsWithin(lcp, basis, kLcpTolerance, size_of_y);
}

void BasisPoint::Write(const ScaledLcp& lcp, Eigen::Ref<Vector> y) const {
  y.setZero();
  const std::vector<Index>& S = indices();
  for (std::size_t p = 0; p < S.size(); ++p) y[S[p]] = lcp.Original(S[p], std::max(0.0, y_[static_cast<Index>(p)]));
}

}  // namespace dlcs
