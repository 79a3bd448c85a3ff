// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/low_rank.h"

#include <algorithm>

#include "core/linalg/bounded_sum.h"

namespace dlcs {

namespace {

// Takes up to `most` columns; returns whether the remainder is `negligible`.
bool TakeColumns(Matrix& matrix, Index most, double negligible, LowRank& factors) {
  factors = {Matrix(matrix.rows(), 0), Matrix(0, matrix.cols())};
  if (matrix.size() == 0) return true;
  const double size = std::sqrt(matrix.colwise().squaredNorm().maxCoeff());
  negligible = std::max(negligible, RoundingOf(16) * size);
  for (Index r = 0; r < std::min(matrix.rows(), matrix.cols()); ++r) {
    Index longest = 0;
    const double length = std::sqrt(matrix.colwise().squaredNorm().maxCoeff(&longest));
    if (!(length > negligible)) return true;
    if (r == most) return false;
    Vector column = matrix.col(longest) / length;
    // The column is orthogonalized again: a late column is mostly rounding of the columns already removed.
    column -= factors.columns * (factors.columns.transpose() * column).eval();
    column.normalize();
    factors.columns.conservativeResize(Eigen::NoChange, r + 1);
    factors.columns.col(r) = column;
    factors.rows.conservativeResize(r + 1, Eigen::NoChange);
    factors.rows.row(r).noalias() = column.transpose() * matrix;
    matrix.noalias() -= column * factors.rows.row(r);
  }
  return true;
}

}  // namespace

LowRank FactorByRank(Matrix matrix) {
  LowRank factors;
  TakeColumns(matrix, std::min(matrix.rows(), matrix.cols()), 0, factors);
  return factors;
}

std::optional<LowRank> FactorIfRankIsAtMost(Index most, double negligible, Matrix matrix) {
  std::optional<LowRank> factors(std::in_place);
  if (!TakeColumns(matrix, most, negligible, *factors)) factors.reset();
  return factors;
}

}  // namespace dlcs
