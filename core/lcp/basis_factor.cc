// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis_factor.h"

#include <Eigen/LU>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>

namespace dlcs {
namespace {

// Up to here plain loops are faster than Eigen's blocked elimination and its calls.
constexpr Index kSmall = 16;

}  // namespace

BasisFactor::BasisFactor(const Matrix& M, Elimination elimination)
    : elimination_(elimination),
      basis_(M.rows(), 0),
      m_matrix_(elimination == Elimination::kMMatrix ? M : Matrix()),
      lu_(elimination == Elimination::kPivoting ? M.rows() : 0, M.rows()),
      source_(M.rows()),
      permuted_(M.rows()) {
  indices_.reserve(M.rows());
}

BasisFactor::BasisFactor(const BasisFactor& other)
    : elimination_(other.elimination_),
      basis_(other.basis_.size(), 0),
      m_matrix_(other.m_matrix_),
      lu_(other.lu_.rows(), other.lu_.cols()),
      source_(other.source_.size()),
      permuted_(other.permuted_.size()) {
  indices_.reserve(basis_.size());
}

bool BasisFactor::Factor(const Matrix& M, const Basis& basis) {
  if (factored_ && std::memcmp(basis.data(), basis_.data(), basis.size()) == 0) return usable_;
  factored_ = true;
  basis_ = basis;
  indices_.clear();
  for (std::size_t i = 0; i < basis.size(); ++i) {
    if (basis[i]) indices_.push_back(static_cast<Index>(i));
  }
  const Index size = static_cast<Index>(indices_.size());
  if (elimination_ == Elimination::kMMatrix) {
    usable_ = m_matrix_.Factor(M, indices_) == size;
    return usable_;
  }
  for (Index j = 0; j < size; ++j) {
    for (Index i = 0; i < size; ++i) lu_(i, j) = M(indices_[i], indices_[j]);
  }
  usable_ = size <= kSmall ? FactorSmall(size) : FactorLarge(size);
  return usable_;
}

bool BasisFactor::FactorSmall(Index size) {
  const double largest = size == 0 ? 0 : lu_.topLeftCorner(size, size).cwiseAbs().maxCoeff();
  const double zero = 2 * std::numeric_limits<double>::epsilon() * static_cast<double>(size) * largest;
  std::iota(source_.begin(), source_.begin() + size, Index{0});
  for (Index p = 0; p < size; ++p) {
    Index row = p;
    for (Index i = p + 1; i < size; ++i) {
      if (std::abs(lu_(i, p)) > std::abs(lu_(row, p))) row = i;
    }
    if (row != p) {
      std::swap(source_[p], source_[row]);
      for (Index j = 0; j < size; ++j) std::swap(lu_(p, j), lu_(row, j));
    }
    const double pivot = lu_(p, p);
    if (!(std::abs(pivot) > zero)) return false;
    const double inverse = 1 / pivot;
    for (Index i = p + 1; i < size; ++i) lu_(i, p) *= inverse;
    for (Index j = p + 1; j < size; ++j) {
      const double factor = lu_(p, j);
      for (Index i = p + 1; i < size; ++i) lu_(i, j) -= lu_(i, p) * factor;
    }
  }
  return true;
}

bool BasisFactor::FactorLarge(Index size) {
  Eigen::Ref<Matrix> block = lu_.topLeftCorner(size, size);
  const double largest = block.cwiseAbs().maxCoeff();
  const Eigen::PartialPivLU<Eigen::Ref<Matrix>> in_place(block);
  const auto& target = in_place.permutationP().indices();  // row i of M_SS went to row target[i]
  for (Index i = 0; i < size; ++i) source_[target[i]] = i;
  const double zero = 2 * std::numeric_limits<double>::epsilon() * static_cast<double>(size) * largest;
  return block.diagonal().cwiseAbs().minCoeff() > zero;
}

void BasisFactor::Solve(Eigen::Ref<Vector> x) {
  if (elimination_ == Elimination::kMMatrix) {
    m_matrix_.Solve(x);
    return;
  }
  const Index size = x.size();
  for (Index p = 0; p < size; ++p) permuted_[p] = x[source_[p]];
  x = permuted_.head(size);
  if (size > kSmall) {
    const auto factors = lu_.topLeftCorner(size, size);
    factors.triangularView<Eigen::UnitLower>().solveInPlace(x);
    factors.triangularView<Eigen::Upper>().solveInPlace(x);
    return;
  }
  for (Index p = 0; p < size; ++p) {
    for (Index i = p + 1; i < size; ++i) x[i] -= lu_(i, p) * x[p];
  }
  for (Index p = size - 1; p >= 0; --p) {
    x[p] /= lu_(p, p);
    for (Index i = 0; i < p; ++i) x[i] -= lu_(i, p) * x[p];
  }
}

}  // namespace dlcs
