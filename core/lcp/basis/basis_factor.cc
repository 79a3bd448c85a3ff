// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis/basis_factor.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/simd/elimination_loops.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
BasisFactor::BasisFactor(const Matrix& M, Elimination elimination)
    : elimination_(elimination),
      basis_(M.rows(), 0),
      m_matrix_(elimination == Elimination::kMMatrix ? M : Matrix()),
      lu_(elimination == Elimination::kPivoting ? M.rows() : 0, M.rows()),
      inverse_(M.rows()),
      source_(M.rows()),
      permuted_(M.rows()) {
  indices_.reserve(M.rows());
}

BasisFactor::BasisFactor(const BasisFactor& other)
    : elimination_(other.elimination_),
      basis_(other.basis_.size(), 0),
      m_matrix_(other.m_matrix_),
      lu_(other.lu_.rows(), other.lu_.cols()),
      inverse_(other.inverse_.size()),
      source_(other.source_.size()),
      permuted_(other.permuted_.size()) {
  indices_.reserve(basis_.size());
}

bool BasisFactor::Factor(const Matrix& M, const Basis& basis) {
  if (factored_ && std::memcmp(basis.data(), basis_.data(), basis.size()) == 0) return usable_;
  factored_ = false;  // remains false if the factorization is stopped
  basis_ = basis;
  indices_.clear();
  for (std::size_t i = 0; i < basis.size(); ++i) {
    if (basis[i]) indices_.push_back(static_cast<Index>(i));
  }
  const Index size = static_cast<Index>(indices_.size());
  if (elimination_ == Elimination::kMMatrix) {
    usable_ = m_matrix_.Factor(M, indices_) == size;
  } else {
    for (Index j = 0; j < size; ++j) {
      for (Index i = 0; i < size; ++i) lu_(i, j) = M(indices_[i], indices_[j]);
    }
    usable_ = Eliminate(size);
  }
  factored_ = true;
  return usable_;
}

// Large matrices are eliminated by panels of columns. The columns behind a panel are updated with the whole panel at
// once, in registers.
bool BasisFactor::Eliminate(Index size) {
  constexpr Index kWhole = 48;  // up to here a panel
  constexpr Index kPanel = 8;
  if (size == 0) return true;
  const Index stride = lu_.rows();
  std::iota(source_.begin(), source_.begin() + size, Index{0});
  const Index panel = size <= kWhole ? size : kPanel;
  for (Index begin = 0; begin < size; begin += panel) {
    LookForStop();
    const Index end = std::min(begin + panel, size), behind = size - end;
    if (!EliminateColumns(begin, end, size, 0, lu_.data(), stride, inverse_.data(), source_.data())) return false;
    if (behind == 0) break;
    for (Index j = end; j < size; ++j) SubstituteForward(end - begin, &lu_(begin, begin), stride, &lu_(begin, j));
    SubtractProduct(behind, behind, end - begin, &lu_(end, begin), stride, &lu_(begin, end), stride, &lu_(end, end),
                    stride);
  }
  return PivotsAreClear(size);
}

// Whether each pivot is more than rounding beside the numbers that it was summed from, Σ_l |L_kl||U_lk|: in its own row
// and column, so whatever their units.
bool BasisFactor::PivotsAreClear(Index size) const {
  const double unit = RoundingOf(4 * size);
  for (Index k = 0; k < size; ++k) {
    const double pivot = std::abs(lu_(k, k));
    double terms = pivot;
    for (Index l = 0; l < k; ++l) terms += std::abs(lu_(k, l) * lu_(l, k));
    if (!(pivot > unit * terms)) return false;
  }
  return true;
}

void BasisFactor::Solve(Eigen::Ref<Vector> x) {
  if (elimination_ == Elimination::kMMatrix) {
    m_matrix_.Solve(x);
    return;
  }
  const Index size = x.size();
  for (Index p = 0; p < size; ++p) permuted_[p] = x[source_[p]];
  x = permuted_.head(size);
  SubstituteForward(size, lu_.data(), lu_.rows(), x.data());
  SubstituteBackward(size, lu_.data(), lu_.rows(), inverse_.data(), x.data());
}

}  // namespace dlcs
