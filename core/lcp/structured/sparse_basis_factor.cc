// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/sparse_basis_factor.h"

namespace dlcs {

bool SparseBasisFactor::Factor(const SparseMatrix& M, bool symmetric, const Basis& basis) {
  if (factored_ && basis == basis_) return usable_;
  factored_ = true;
  usable_ = true;
  symmetric_ = symmetric;
  basis_ = basis;
  indices_.clear();
  for (std::size_t i = 0; i < basis.size(); ++i) {
    position_[i] = basis[i] ? static_cast<int>(indices_.size()) : -1;
    if (basis[i]) indices_.push_back(static_cast<Index>(i));
  }
  if (indices_.empty()) return true;
  if (symmetric_) {
    ldlt_.compute(Submatrix(M, true));
    usable_ = ldlt_.info() == Eigen::Success;
  } else {
    lu_.compute(Submatrix(M, false));
    usable_ = lu_.info() == Eigen::Success;
  }
  return usable_;
}

SparseMatrix SparseBasisFactor::Submatrix(const SparseMatrix& M, bool lower_only) {
  const Index size = static_cast<Index>(indices_.size());
  std::vector<int> starts{0}, rows;
  std::vector<double> values;
  for (Index p = 0; p < size; ++p) {
    for (SparseMatrix::InnerIterator it(M, indices_[p]); it; ++it) {
      const int row = position_[it.row()];
      if (row < 0 || (lower_only && row < p)) continue;
      rows.push_back(row);
      values.push_back(it.value());
    }
    starts.push_back(static_cast<int>(rows.size()));
  }
  return Eigen::Map<const SparseMatrix>(size, size, starts.back(), starts.data(), rows.data(), values.data());
}

Vector SparseBasisFactor::Solve(const Vector& b) const {
  if (indices_.empty()) return b;
  if (symmetric_) return ldlt_.solve(b);
  return lu_.solve(b);
}

}  // namespace dlcs
