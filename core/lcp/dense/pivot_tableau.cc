// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/pivot_tableau.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/lcp/basis/tolerance.h"
#include "core/linalg/simd/simd_dispatch.h"

namespace dlcs {
namespace {

constexpr Index kAlign = 8;  // rows are filled up with zeros to as many

}  // namespace

PivotTableau::PivotTableau(Index rows, Index columns)
    : columns_(columns),
      values_(Values::Zero(rows, (columns + 1 + kAlign - 1) / kAlign * kAlign)),
      basic_(rows),
      first_(rows),
      nonbasic_(columns),
      column_(rows + columns) {
  ties_.reserve(rows);
  Reset();
}

void PivotTableau::Reset() {
  values_.rightCols(values_.cols() - columns_ - 1).setZero();
  for (Index i = 0; i < rows(); ++i) {
    basic_[i] = first_[i] = i;
    column_[i] = kNone;
  }
  for (Index j = 0; j < columns_; ++j) {
    nonbasic_[j] = rows() + j;
    column_[rows() + j] = j;
  }
}

Index PivotTableau::RatioTest(Index entering_column, double zero, LemkeTies rule, Index wanted) {
  const auto column = values_.col(entering_column);
  const auto values = right();
  const double smallest_pivot = zero * column.cwiseAbs().maxCoeff();
  double step = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < rows(); ++i) {
    if (column[i] > smallest_pivot) step = std::min(step, values[i] / column[i]);
  }
  if (!std::isfinite(step)) return kNone;
  // Rows whose basic variable would fall to zero, to rounding.
  const double tie = kLcpTolerance * values.cwiseAbs().maxCoeff();
  ties_.clear();
  for (Index i = 0; i < rows(); ++i) {
    if (column[i] <= smallest_pivot || values[i] - step * column[i] > tie) continue;
    if (basic_[i] == wanted) return i;
    ties_.push_back(i);
  }
  if (rule != LemkeTies::kLexicographic) {
    const auto pair = [this](Index row) { return basic_[row] % rows(); };
    const auto [first, last] =
        std::minmax_element(ties_.begin(), ties_.end(), [&](Index a, Index b) { return pair(a) < pair(b); });
    return rule == LemkeTies::kFirst ? *first : *last;
  }
  BreakTie(entering_column);
  return *std::max_element(ties_.begin(), ties_.end(), [&](Index a, Index b) { return column[a] < column[b]; });
}

// Keeps those rows of ties_ whose row of the inverse, divided by the entry in the entering column, is
// lexicographically least. In exact arithmetic that is one row. The inverse stands in the columns of the variables that
// were basic first, w without a guess.
void PivotTableau::BreakTie(Index entering_column) {
  for (Index k = 0; k < rows() && ties_.size() > 1; ++k) {
    const Index first = first_[k];
    const auto ratio = [&](Index i) {
      const double of_first = column_[first] == kNone ? (basic_[i] == first ? 1 : 0) : values_(i, column_[first]);
      return of_first / values_(i, entering_column);
    };
    double least = std::numeric_limits<double>::infinity();
    for (const Index i : ties_) least = std::min(least, ratio(i));
    const double limit = least + kWorkingPrecision * (1 + std::abs(least));
    std::erase_if(ties_, [&](Index i) { return ratio(i) > limit; });
  }
}

void PivotTableau::Pivot(Index row, Index column) {
  RunWide([rows = rows(), cols = values_.cols(), row, column, all = values_.data()]() DLCS_WIDE {
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

}  // namespace dlcs
