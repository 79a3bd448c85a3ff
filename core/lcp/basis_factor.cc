// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis_factor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>

#include "core/linalg/elimination_loops.h"
#include "core/linalg/norms.h"
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
  factored_ = false;  // also where what follows is stopped
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

// By panels of columns: those behind take a whole panel at once, from the registers.
bool BasisFactor::Eliminate(Index size) {
  constexpr Index kPanel = 8;
  double largest = 0;
  for (Index j = 0; j < size; ++j) {
    for (Index i = 0; i < size; ++i) largest = NanMax(largest, std::abs(lu_(i, j)));
  }
  const double zero = 2 * std::numeric_limits<double>::epsilon() * static_cast<double>(size) * largest;
  std::iota(source_.begin(), source_.begin() + size, Index{0});
  for (Index begin = 0; begin < size; begin += kPanel) {
    LookForStop();
    const Index end = std::min(begin + kPanel, size), behind = size - end;
    for (Index p = begin; p < end; ++p) {
      if (!Exchange(p, size, zero)) return false;
      inverse_[p] = 1 / lu_(p, p);
      for (Index i = p + 1; i < size; ++i) lu_(i, p) *= inverse_[p];
      for (Index j = p + 1; j < end; ++j) SubtractMultiple(size - p - 1, lu_(p, j), &lu_(p, p) + 1, &lu_(p, j) + 1);
    }
    if (behind == 0) break;
    for (Index j = end; j < size; ++j) {
      for (Index p = begin; p < end; ++p) {
        for (Index i = p + 1; i < end; ++i) lu_(i, j) -= lu_(i, p) * lu_(p, j);
      }
    }
    SubtractProduct(behind, behind, end - begin, &lu_(end, begin), lu_.rows(), &lu_(begin, end), lu_.rows(),
                    &lu_(end, end), lu_.rows());
  }
  return true;
}

// Brings the row with the largest entry of column p to p; false where that is zero to rounding.
bool BasisFactor::Exchange(Index p, Index size, double zero) {
  Index row = p;
  for (Index i = p + 1; i < size; ++i) {
    if (std::abs(lu_(i, p)) > std::abs(lu_(row, p))) row = i;
  }
  if (row != p) {
    std::swap(source_[p], source_[row]);
    for (Index j = 0; j < size; ++j) std::swap(lu_(p, j), lu_(row, j));
  }
  return std::abs(lu_(p, p)) > zero;
}

void BasisFactor::Solve(Eigen::Ref<Vector> x) {
  if (elimination_ == Elimination::kMMatrix) {
    m_matrix_.Solve(x);
    return;
  }
  const Index size = x.size();
  for (Index p = 0; p < size; ++p) permuted_[p] = x[source_[p]];
  x = permuted_.head(size);
  for (Index p = 0; p + 1 < size; ++p) SubtractMultiple(size - p - 1, x[p], &lu_(p, p) + 1, &x[p] + 1);
  for (Index p = size - 1; p >= 0; --p) {
    x[p] *= inverse_[p];
    SubtractMultiple(p, x[p], &lu_(0, p), x.data());
  }
}

}  // namespace dlcs
