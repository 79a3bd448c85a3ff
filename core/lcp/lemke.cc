// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/lemke.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel/stop_scope.h"

namespace dlcs {

Lemke::Lemke(Index n) : n_(n), tableau_(n, 2 * n + 2), basic_(n), ray_(n) { ties_.reserve(n); }

void Lemke::Load(const ScaledLcp& lcp) {
  double largest = 0;
  for (Index i = 0; i < n_; ++i) {
    // What is negative only within the tolerance is a degenerate zero, and the lexicographic rule is for
    // those.
    const double entry = lcp.q[i] < 0 && lcp.q[i] >= -lcp.tolerance[i] ? 0 : lcp.q[i];
    tableau_(i, 2 * n_ + 1) = entry;
    largest = std::max(largest, std::abs(entry));
    basic_[i] = i;
  }
  tableau_.leftCols(n_).setIdentity();
  tableau_.middleCols(n_, n_) = -lcp.M();
  tableau_.col(2 * n_).setConstant(-1);
  if (largest > 0) tableau_.col(2 * n_ + 1) /= std::exp2(std::ilogb(largest));
}

LemkeEnd Lemke::Run(const ScaledLcp& lcp, double zero, Basis& basis) {
  const Index kArtificial = 2 * n_;
  const Index max_pivots = 500 + 20 * n_;  // skew matrices with n = 400 took 7 n
  Load(lcp);
  pivots_ = 0;
  // The lexicographically smallest row of (q, I): of equal entries the last.
  Index row = 0;
  for (Index i = 1; i < n_; ++i) {
    if (tableau_(i, 2 * n_ + 1) <= tableau_(row, 2 * n_ + 1)) row = i;
  }
  std::fill(basis.begin(), basis.end(), std::uint8_t{0});
  if (tableau_(row, 2 * n_ + 1) >= 0) return LemkeEnd::kBasis;
  Index entering = kArtificial;
  while (pivots_ < max_pivots) {
    LookForStop();
    Pivot(row, entering);
    ++pivots_;
    const Index leaving = basic_[row];
    basic_[row] = entering;
    if (leaving == kArtificial) {
      for (Index i = 0; i < n_; ++i) {
        if (basic_[i] >= n_) basis[basic_[i] - n_] = 1;
      }
      return LemkeEnd::kBasis;
    }
    entering = leaving < n_ ? leaving + n_ : leaving - n_;
    row = RatioTest(entering, zero);
    if (row == kNoRow) {
      RecordRay(entering);
      return LemkeEnd::kRay;
    }
  }
  return LemkeEnd::kPivotLimit;
}

Index Lemke::RatioTest(Index entering, double zero) {
  constexpr double kTie = 1e-13;
  const auto column = tableau_.col(entering);
  const auto values = tableau_.col(2 * n_ + 1);
  const double smallest_pivot = zero * column.cwiseAbs().maxCoeff();
  double step = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < n_; ++i) {
    if (column[i] > smallest_pivot) step = std::min(step, values[i] / column[i]);
  }
  if (!std::isfinite(step)) return kNoRow;
  // Rows whose basic variable would fall to zero, to rounding.
  const double tie = kTie * values.cwiseAbs().maxCoeff();
  ties_.clear();
  for (Index i = 0; i < n_; ++i) {
    if (column[i] <= smallest_pivot || values[i] - step * column[i] > tie) continue;
    if (basic_[i] == 2 * n_) return i;  // z₀ reaches zero: done
    ties_.push_back(i);
  }
  BreakTie(entering);
  return *std::max_element(ties_.begin(), ties_.end(),
                           [&](Index a, Index b) { return column[a] < column[b]; });
}

// Keeps those rows of ties_ whose row of the inverse, divided by the entry in the entering column, is
// lexicographically least. In exact arithmetic that is one row.
void Lemke::BreakTie(Index entering) {
  constexpr double kEqual = 1e-11;
  for (Index k = 0; k < n_ && ties_.size() > 1; ++k) {
    double least = std::numeric_limits<double>::infinity();
    for (const Index i : ties_) least = std::min(least, tableau_(i, k) / tableau_(i, entering));
    const double limit = least + kEqual * (1 + std::abs(least));
    std::erase_if(ties_, [&](Index i) { return tableau_(i, k) / tableau_(i, entering) > limit; });
  }
}

void Lemke::Pivot(Index row, Index column) {
  tableau_.row(row) /= tableau_(row, column);
  tableau_(row, column) = 1;
  for (Index i = 0; i < n_; ++i) {
    const double factor = tableau_(i, column);
    if (i == row || factor == 0) continue;
    tableau_.row(i).noalias() -= factor * tableau_.row(row);
    tableau_(i, column) = 0;
  }
}

void Lemke::RecordRay(Index entering) {
  ray_.setZero();
  for (Index i = 0; i < n_; ++i) {
    if (basic_[i] >= n_ && basic_[i] < 2 * n_) ray_[basic_[i] - n_] = std::max(0.0, -tableau_(i, entering));
  }
  if (entering >= n_) ray_[entering - n_] = 1;
}

}  // namespace dlcs
