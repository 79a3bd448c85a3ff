// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/sparse_point.h"

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <cmath>

#include "core/lcp/basis/basis_point.h"
#include "core/linalg/symmetry.h"

namespace dlcs {
namespace {

SparseLcp::Ordered Order(const SparseMatrix& M) {
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> original;  // column i: where index i comes from
  Eigen::AMDOrdering<int>()(M, original);
  SparseLcp::Ordered ordered;
  ordered.M = original.transpose() * M * original;
  ordered.original.assign(original.indices().begin(), original.indices().end());
  ordered.symmetric = IsSymmetric(M);
  return ordered;
}

}  // namespace

SparseLcp::SparseLcp(const SparseMatrix& M)
    : matrix(std::make_shared<const Ordered>(Order(M))), q(Vector::Zero(M.rows())), tolerance(q) {}

bool SparseLcp::Load(const Eigen::Ref<const Vector>& original_q, const Eigen::Ref<const Vector>& original_tolerance) {
  for (Index i = 0; i < size(); ++i) {
    q[i] = original_q[matrix->original[i]];
    tolerance[i] = original_tolerance[matrix->original[i]];
  }
  return q.allFinite();
}

bool SparsePoint::Compute(const SparseLcp& lcp, const Basis& basis) {
  violations_.clear();
  accurate_ = false;
  if (!factor_.Factor(lcp.matrix->M, lcp.matrix->symmetric, basis)) return false;
  const std::vector<Index>& S = factor_.indices();
  y_ = factor_.Solve(-lcp.q(S));
  if (!Evaluate(lcp)) return false;
  if (!accurate_) {
    y_ -= factor_.Solve(w_(S));
    if (!Evaluate(lcp)) return false;
  }
  FindViolations(
      basis, y_, w_, allowed_, [&](Index i, double value) { return Negligible(lcp, i, value); }, violations_);
  return true;
}

bool SparsePoint::Evaluate(const SparseLcp& lcp) {
  constexpr double kRounding = 1e-14;
  const std::vector<Index>& S = factor_.indices();
  if (!y_.allFinite()) return false;
  w_ = lcp.q;
  allowed_ = lcp.q.cwiseAbs();
  for (std::size_t p = 0; p < S.size(); ++p) {
    for (SparseMatrix::InnerIterator it(lcp.matrix->M, S[p]); it; ++it) {
      const double term = it.value() * y_[static_cast<Index>(p)];
      w_[it.row()] += term;
      allowed_[it.row()] += std::abs(term);
    }
  }
  allowed_ = lcp.tolerance + kRounding * allowed_;
  accurate_ = std::all_of(S.begin(), S.end(), [this](Index i) { return std::abs(w_[i]) <= allowed_[i]; });
  return w_.allFinite();
}

bool SparsePoint::Negligible(const SparseLcp& lcp, Index j, double value) const {
  for (SparseMatrix::InnerIterator it(lcp.matrix->M, j); it; ++it) {
    if (std::abs(it.value() * value) > allowed_[it.row()]) return false;
  }
  return true;
}

void SparsePoint::Write(const SparseLcp& lcp, Eigen::Ref<Vector> y) const {
  y.setZero();
  const std::vector<Index>& S = factor_.indices();
  for (std::size_t p = 0; p < S.size(); ++p) {
    y[lcp.matrix->original[S[p]]] = std::max(0.0, y_[static_cast<Index>(p)]);
  }
}

}  // namespace dlcs
