// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/least_element.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/lcp/basis/tolerance.h"

namespace dlcs {

LeastElementSolver::LeastElementSolver(const Matrix& M)
    : lcp_(M), point_(lcp_, Elimination::kMMatrix), ordered_(lcp_.M()), excluded_(M.rows(), 0), multiplier_(M.rows()) {
  order_.reserve(M.rows());
  added_.reserve(M.rows());
}

LcpStatus LeastElementSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                    Basis& basis, Eigen::Ref<Vector> y) {
  pivots_ = 0;
  refused_ = -1;
  y.setZero();
  verdict_ = LcpStatus::kNonFinite;
  if (!lcp_.Load(q, tolerance)) return verdict_;
  verdict_ = LcpStatus::kSolved;
  std::fill(excluded_.begin(), excluded_.end(), std::uint8_t{0});
  if (!point_.Compute(lcp_, basis) || !KeepProvenIndices(basis)) {
    std::fill(basis.begin(), basis.end(), std::uint8_t{0});
    point_.Compute(lcp_, basis);
  }
  for (;;) {
    added_.clear();
    for (const Index r : point_.violations()) {
      if (!basis[r] && !excluded_[r]) added_.push_back(r);
    }
    if (added_.empty()) break;
    order_ = point_.indices();
    order_.insert(order_.end(), added_.begin(), added_.end());
    for (const Index r : added_) basis[r] = 1;
    pivots_ += static_cast<Index>(added_.size());
    if (point_.Compute(lcp_, basis)) continue;
    const Refusal refusal = Examine(basis);
    if (refusal == Refusal::kWithinRounding && point_.Compute(lcp_, basis)) continue;
    return verdict_ = refusal == Refusal::kInfeasible ? LcpStatus::kInfeasible : LcpStatus::kSingular;
  }
  if (!point_.solved()) return verdict_ = LcpStatus::kSingular;
  point_.Write(lcp_, y);
  return verdict_;
}

// Leaves those indices of the guess that are proven to be in the basis of the least element. False when even
// their point cannot be computed.
bool LeastElementSolver::KeepProvenIndices(Basis& basis) {
  const std::vector<Index>& S = point_.indices();
  bool changed = false;
  for (std::size_t p = 0; p < S.size(); ++p) {
    const double value = point_.y(static_cast<Index>(p));
    if (value > 0 && !point_.Negligible(lcp_, S[p], value)) continue;
    basis[S[p]] = 0;
    changed = true;
  }
  return !changed || point_.Compute(lcp_, basis);
}

// Some index of added_ has no positive pivot after those before it in order_. Its multipliers tell whether
// that proves infeasibility or whether its w_r was negative only by the rounding of a nearly singular basis;
// in that case it is excluded and the basis is what was eliminated before it.
LeastElementSolver::Refusal LeastElementSolver::Examine(Basis& basis) {
  const Index position = ordered_.Factor(lcp_.M(), order_);
  if (position == static_cast<Index>(order_.size())) return Refusal::kUnclear;
  const Index r = order_[position];
  auto v = multiplier_.head(position);
  for (Index p = 0; p < position; ++p) v[p] = -lcp_.M()(r, order_[p]);
  ordered_.SolveTransposed(v);
  double gain = lcp_.q[r];
  double doubt = lcp_.tolerance[r] + kWorkingPrecision * std::abs(lcp_.q[r]);
  for (Index p = 0; p < position; ++p) {
    const Index i = order_[p];
    gain += v[p] * lcp_.q[i];
    doubt += v[p] * (lcp_.tolerance[i] + kWorkingPrecision * std::abs(lcp_.q[i]));
  }
  if (gain < -doubt) {
    refused_ = r;
    return Refusal::kInfeasible;
  }
  excluded_[r] = 1;
  for (std::size_t p = position; p < order_.size(); ++p) basis[order_[p]] = 0;
  return Refusal::kWithinRounding;
}

LcpStats LeastElementSolver::Account() const {
  LcpStats account{pivots_, "Chandrasekaran (least element)", ""};
  switch (verdict_) {
    case LcpStatus::kInfeasible:
      account.message = absl::StrCat("no y >= 0 has q + M y >= 0: w[", refused_,
                                     "] is negative and cannot be raised (found by Chandrasekaran's method)");
      break;
    case LcpStatus::kSingular:
      account.message = "the basis of the least element is singular to working precision";
      break;
    case LcpStatus::kNonFinite:
      account.message = "q has an entry that is not finite";
      break;
    case LcpStatus::kSolved:
    case LcpStatus::kRay:
    case LcpStatus::kPivotLimit:
      break;
  }
  return account;
}

std::unique_ptr<LcpSolver> LeastElementSolver::Clone() const { return std::make_unique<LeastElementSolver>(*this); }

}  // namespace dlcs
