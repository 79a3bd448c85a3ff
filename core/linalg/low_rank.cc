// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/low_rank.h"

#include <algorithm>
#include <limits>

namespace dlcs {

LowRank FactorByRank(Matrix matrix) {
  LowRank factors{Matrix(matrix.rows(), 0), Matrix(0, matrix.cols())};
  const double size = matrix.size() > 0 ? std::sqrt(matrix.colwise().squaredNorm().maxCoeff()) : 0;
  const Index most = std::min(matrix.rows(), matrix.cols());
  for (Index r = 0; r < most; ++r) {
    Index longest = 0;
    const double length = std::sqrt(matrix.colwise().squaredNorm().maxCoeff(&longest));
    if (!(length > 8 * std::numeric_limits<double>::epsilon() * size)) break;
    Vector column = matrix.col(longest) / length;
    // Again, since what is left of a column late is mostly rounding of the columns taken out.
    column -= factors.columns * (factors.columns.transpose() * column).eval();
    column.normalize();
    factors.columns.conservativeResize(Eigen::NoChange, r + 1);
    factors.columns.col(r) = column;
    factors.rows.conservativeResize(r + 1, Eigen::NoChange);
    factors.rows.row(r).noalias() = column.transpose() * matrix;
    matrix.noalias() -= column * factors.rows.row(r);
  }
  return factors;
}

}  // namespace dlcs
