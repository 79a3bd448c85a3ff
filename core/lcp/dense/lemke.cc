// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/lemke.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/lcp/basis/tolerance.h"
#include "core/linalg/simd/simd_dispatch.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

Lemke::Lemke(Index n)
    : n_(n),
      tableau_(n, (n + 2 + kAlign - 1) / kAlign * kAlign),
      basic_(n),
      first_(n),
      nonbasic_(n + 1),
      column_(2 * n + 1),
      ray_(n) {
  ties_.reserve(n);
}

void Lemke::Load(const ScaledLcp& lcp) {
  double largest = 0;
  tableau_.leftCols(n_) = -lcp.M();
  tableau_.col(n_).setConstant(-1);
  tableau_.rightCols(tableau_.cols() - n_ - 1).setZero();
  for (Index i = 0; i < n_; ++i) {
    // An entry that is negative by no more than the tolerance is a degenerate zero, which the lexicographic rule
    // treats.
    const double entry = lcp.q[i] < 0 && lcp.q[i] >= -lcp.tolerance[i] ? 0 : lcp.q[i];
    tableau_(i, right()) = entry;
    largest = std::max(largest, std::abs(entry));
    basic_[i] = first_[i] = i;
    column_[i] = kNone;
  }
  for (Index j = 0; j <= n_; ++j) {
    nonbasic_[j] = n_ + j;
    column_[n_ + j] = j;
  }
  if (largest > 0) tableau_.col(right()) /= std::exp2(std::ilogb(largest));
}

LemkeEnd Lemke::Run(const ScaledLcp& lcp, double zero, Basis& basis) {
  rule_ = LemkeTies::kLexicographic;
  Load(lcp);
  pivots_ = 0;
  // The lexicographically smallest row of (q, I): of equal entries the last.
  Index row = 0;
  for (Index i = 1; i < n_; ++i) {
    if (tableau_(i, right()) <= tableau_(row, right())) row = i;
  }
  std::fill(basis.begin(), basis.end(), std::uint8_t{0});
  if (tableau_(row, right()) >= 0) return LemkeEnd::kBasis;
  return FollowFrom(row, zero, basis);
}

LemkeEnd Lemke::Follow(const ScaledLcp& lcp, double zero, double others, LemkeTies rule, Basis& basis) {
  Load(lcp);
  rule_ = rule;
  pivots_ = 0;
  if (!Enter(basis, zero)) return LemkeEnd::kRay;
  const auto values = tableau_.col(right());
  const double rounding = 1e-15 * values.cwiseAbs().maxCoeff();
  Index row = kNone;
  for (Index i = 0; i < n_; ++i) {
    const bool is_violated = values[i] < -rounding;
    tableau_(i, column_[2 * n_]) = is_violated ? -1 : -others;
    if (!is_violated) {
      tableau_(i, right()) = std::max(0.0, values[i]);
    } else if (row == kNone || values[i] <= values[row]) {
      row = i;
    }
  }
  if (row == kNone) return LemkeEnd::kBasis;
  return FollowFrom(row, zero, basis);
}

// Makes y_S basic for w_S, the largest pivot first. False if M_SS is singular.
bool Lemke::Enter(const Basis& basis, double zero) {
  std::vector<Index> rows, columns;
  for (Index i = 0; i < n_; ++i) {
    if (!basis[i]) continue;
    rows.push_back(i);
    columns.push_back(i);
  }
  while (!rows.empty()) {
    std::size_t row = 0, column = 0;
    double largest = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = 0; j < columns.size(); ++j) {
        const double entry = std::abs(tableau_(rows[i], columns[j]));
        if (entry <= largest) continue;
        largest = entry;
        row = i;
        column = j;
      }
    }
    if (!(largest > zero)) return false;
    Pivot(rows[row], columns[column]);
    rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(row));
    columns.erase(columns.begin() + static_cast<std::ptrdiff_t>(column));
  }
  first_ = basic_;
  return true;
}

// From the row in which z₀ becomes basic.
LemkeEnd Lemke::FollowFrom(Index row, double zero, Basis& basis) {
  const Index kArtificial = 2 * n_;
  const Index max_pivots = 500 + 20 * n_;  // skew matrices with n = 400 took 7 n
  std::fill(basis.begin(), basis.end(), std::uint8_t{0});
  Index entering = kArtificial;
  while (pivots_ < max_pivots) {
    LookForStop();
    const Index leaving = basic_[row];
    Pivot(row, column_[entering]);
    ++pivots_;
    if (leaving == kArtificial) {
      for (Index i = 0; i < n_; ++i) {
        if (basic_[i] >= n_) basis[basic_[i] - n_] = 1;
      }
      return LemkeEnd::kBasis;
    }
    entering = leaving < n_ ? leaving + n_ : leaving - n_;
    row = RatioTest(column_[entering], zero);
    if (row == kNone) {
      RecordRay(entering);
      return LemkeEnd::kRay;
    }
  }
  return LemkeEnd::kPivotLimit;
}

Index Lemke::RatioTest(Index entering_column, double zero) {
  const auto column = tableau_.col(entering_column);
  const auto values = tableau_.col(right());
  const double smallest_pivot = zero * column.cwiseAbs().maxCoeff();
  double step = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < n_; ++i) {
    if (column[i] > smallest_pivot) step = std::min(step, values[i] / column[i]);
  }
  if (!std::isfinite(step)) return kNone;
  // Rows whose basic variable would fall to zero, to rounding.
  const double tie = kLcpTolerance * values.cwiseAbs().maxCoeff();
  ties_.clear();
  for (Index i = 0; i < n_; ++i) {
    if (column[i] <= smallest_pivot || values[i] - step * column[i] > tie) continue;
    if (basic_[i] == 2 * n_) return i;  // z₀ reaches zero: done
    ties_.push_back(i);
  }
  if (rule_ != LemkeTies::kLexicographic) {
    const auto pair = [this](Index row) { return basic_[row] % n_; };
    const auto [first, last] =
        std::minmax_element(ties_.begin(), ties_.end(), [&](Index a, Index b) { return pair(a) < pair(b); });
    return rule_ == LemkeTies::kFirst ? *first : *last;
  }
  BreakTie(entering_column);
  return *std::max_element(ties_.begin(), ties_.end(), [&](Index a, Index b) { return column[a] < column[b]; });
}

// Keeps those rows of ties_ whose row of the inverse, divided by the entry in the entering column, is
// lexicographically least. In exact arithmetic that is one row. The inverse stands in the columns of the variables that
// were basic first, w without a guess.
void Lemke::BreakTie(Index entering_column) {
  for (Index k = 0; k < n_ && ties_.size() > 1; ++k) {
    const Index first = first_[k];
    const auto ratio = [&](Index i) {
      const double of_first = column_[first] == kNone ? (basic_[i] == first ? 1 : 0) : tableau_(i, column_[first]);
      return of_first / tableau_(i, entering_column);
    };
    double least = std::numeric_limits<double>::infinity();
    for (const Index i : ties_) least = std::min(least, ratio(i));
    const double limit = least + kWorkingPrecision * (1 + std::abs(least));
    std::erase_if(ties_, [&](Index i) { return ratio(i) > limit; });
  }
}

// The column then is that of the variable that was basic.
void Lemke::Pivot(Index row, Index column) {
  RunWide([rows = n_, cols = tableau_.cols(), row, column, all = tableau_.data()]() DLCS_WIDE {
    double* __restrict pivots = all + row * cols;
    const double pivot = pivots[column];
    pivots[column] = 1;
    for (Index j = 0; j < cols; ++j) pivots[j] /= pivot;
    for (Index i = 0; i < rows; ++i) {
      double* __restrict other = all + i * cols;
      const double factor = other[column];
      if (i == row || factor == 0) continue;
      other[column] = 0;
      for (Index j = 0; j < cols; ++j) other[j] -= factor * pivots[j];
    }
  });
  column_[nonbasic_[column]] = kNone;
  column_[basic_[row]] = column;
  std::swap(basic_[row], nonbasic_[column]);
}

void Lemke::RecordRay(Index entering) {
  ray_.setZero();
  for (Index i = 0; i < n_; ++i) {
    if (basic_[i] >= n_ && basic_[i] < 2 * n_) ray_[basic_[i] - n_] = std::max(0.0, -tableau_(i, column_[entering]));
  }
  if (entering >= n_) ray_[entering - n_] = 1;
}

}  // namespace dlcs
