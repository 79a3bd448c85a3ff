// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/lemke.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/lcp/basis/tolerance.h"
#include "core/linalg/bounded_sum.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

Lemke::Lemke(Index n) : n_(n), tableau_(n, n + 1), ray_(n) {}

void Lemke::Load(const ScaledLcp& lcp) {
  double largest = 0;
  tableau_.Reset();
  tableau_.columns().leftCols(n_) = -lcp.M();
  tableau_.columns().col(n_).setConstant(-1);
  for (Index i = 0; i < n_; ++i) {
    // An entry that is negative by no more than the tolerance is a degenerate zero, which the lexicographic rule
    // treats.
    const double entry = lcp.q[i] < 0 && lcp.q[i] >= -lcp.tolerance[i] ? 0 : lcp.q[i];
    tableau_.right()[i] = entry;
    largest = std::max(largest, std::abs(entry));
  }
  if (largest > 0) tableau_.right() /= std::exp2(std::ilogb(largest));
}

LemkeEnd Lemke::Run(const ScaledLcp& lcp, double zero, Basis& basis) {
  rule_ = LemkeTies::kLexicographic;
  Load(lcp);
  pivots_ = 0;
  // The lexicographically smallest row of (q, I): of equal entries the last.
  Index row = 0;
  for (Index i = 1; i < n_; ++i) {
    if (tableau_.right()[i] <= tableau_.right()[row]) row = i;
  }
  std::fill(basis.begin(), basis.end(), std::uint8_t{0});
  if (tableau_.right()[row] >= 0) return LemkeEnd::kBasis;
  return FollowFrom(row, zero, basis);
}

LemkeEnd Lemke::Follow(const ScaledLcp& lcp, double zero, double others, LemkeTies rule, Basis& basis) {
  Load(lcp);
  rule_ = rule;
  pivots_ = 0;
  if (!Enter(basis, zero)) return LemkeEnd::kRay;
  auto values = tableau_.right();
  auto artificial = tableau_.columns().col(tableau_.column_of(2 * n_));
  const double rounding = RoundingOf(8) * values.cwiseAbs().maxCoeff();
  Index row = PivotTableau::kNone;
  for (Index i = 0; i < n_; ++i) {
    const bool is_violated = values[i] < -rounding;
    artificial[i] = is_violated ? -1 : -others;
    if (!is_violated) {
      values[i] = std::max(0.0, values[i]);
    } else if (row == PivotTableau::kNone || values[i] <= values[row]) {
      row = i;
    }
  }
  if (row == PivotTableau::kNone) return LemkeEnd::kBasis;
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
        const double entry = std::abs(tableau_.entry(rows[i], columns[j]));
        if (entry <= largest) continue;
        largest = entry;
        row = i;
        column = j;
      }
    }
    if (!(largest > zero)) return false;
    tableau_.Pivot(rows[row], columns[column]);
    rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(row));
    columns.erase(columns.begin() + static_cast<std::ptrdiff_t>(column));
  }
  tableau_.Keep();
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
    const Index leaving = tableau_.basic(row);
    tableau_.Pivot(row, tableau_.column_of(entering));
    ++pivots_;
    if (leaving == kArtificial) {
      for (Index i = 0; i < n_; ++i) {
        if (tableau_.basic(i) >= n_) basis[tableau_.basic(i) - n_] = 1;
      }
      return LemkeEnd::kBasis;
    }
    entering = leaving < n_ ? leaving + n_ : leaving - n_;
    row = tableau_.RatioTest(tableau_.column_of(entering), zero, rule_, kArtificial);
    if (row == PivotTableau::kNone) {
      RecordRay(entering);
      return LemkeEnd::kRay;
    }
  }
  return LemkeEnd::kPivotLimit;
}

void Lemke::RecordRay(Index entering) {
  ray_.setZero();
  for (Index i = 0; i < n_; ++i) {
    const Index variable = tableau_.basic(i);
    if (variable < n_ || variable == 2 * n_) continue;
    ray_[variable - n_] = std::max(0.0, -tableau_.entry(i, tableau_.column_of(entering)));
  }
  if (entering >= n_) ray_[entering - n_] = 1;
}

}  // namespace dlcs
