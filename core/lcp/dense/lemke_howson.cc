// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/lemke_howson.h"

#include <algorithm>

#include "core/parallel/stop_scope.h"

namespace dlcs {

LemkeHowson::LemkeHowson(const Matrix& R, const Matrix& C)
    : m_(R.rows()), n_(R.cols()), u_(C.transpose()), v_(R), basis_(m_ + n_) {}

void LemkeHowson::Side::Reset() {
  tableau.Reset();
  tableau.columns() = -A;
  tableau.right().setConstant(-1);
  is_feasible = false;
}

Index LemkeHowson::Side::Exchange(Index entering, double zero, Index wanted) {
  const Index column = tableau.column_of(entering);
  Index row = 0;
  if (is_feasible) {
    row = tableau.RatioTest(column, zero, LemkeTies::kLexicographic, wanted);
    if (row == PivotTableau::kNone) return PivotTableau::kNone;
  } else {
    // As y_j falls from infinity, the first of w = A_j y_j - 1 that becomes zero; of several the last, which is the
    // lexicographically least: with 1 - ε, 1 - ε², ... in place of 1 it becomes zero before the others.
    for (Index i = 1; i < tableau.rows(); ++i) {
      if (tableau.entry(i, column) >= tableau.entry(row, column)) row = i;
    }
    is_feasible = true;
  }
  const Index leaving = tableau.basic(row);
  tableau.Pivot(row, column);
  return leaving;
}

// In the tableau of u the slacks of v are the variables from 0 to n - 1, and u those behind them.
Index LemkeHowson::VariableOf(bool of_u, Index strategy) const {
  if (!of_u) return strategy;
  return strategy < m_ ? n_ + strategy : strategy - m_;
}

Index LemkeHowson::StrategyOf(bool of_u, Index variable) const {
  if (!of_u) return variable;
  return variable < n_ ? m_ + variable : variable - n_;
}

void LemkeHowson::Reset() {
  u_.Reset();
  v_.Reset();
}

LemkeHowson::End LemkeHowson::Follow(Index strategy, Index max_pivots, double zero) {
  const auto is_basic = [&](bool of_u) {
    return (of_u ? u_ : v_).tableau.column_of(VariableOf(of_u, strategy)) == PivotTableau::kNone;
  };
  // Of y_k and w_k the one that is not basic enters, at the begin y_k.
  bool of_u = strategy < m_;
  if (is_basic(of_u)) of_u = !of_u;
  Index entering = strategy;
  for (pivots_ = 0; pivots_ < max_pivots;) {
    LookForStop();
    Side& side = of_u ? u_ : v_;
    const Index left = side.Exchange(VariableOf(of_u, entering), zero, VariableOf(of_u, strategy));
    if (left == PivotTableau::kNone) return End::kRay;
    ++pivots_;
    entering = StrategyOf(of_u, left);
    // The slacks of the side that has had no exchange are negative.
    if (entering == strategy && u_.is_feasible && v_.is_feasible) {
      std::fill(basis_.begin(), basis_.end(), std::uint8_t{0});
      for (Index i = 0; i < n_; ++i) {
        if (u_.tableau.basic(i) >= n_) basis_[u_.tableau.basic(i) - n_] = 1;
      }
      for (Index i = 0; i < m_; ++i) {
        if (v_.tableau.basic(i) >= m_) basis_[v_.tableau.basic(i)] = 1;
      }
      return End::kBasis;
    }
    of_u = !of_u;
  }
  return End::kPivotLimit;
}

}  // namespace dlcs
