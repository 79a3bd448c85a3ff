// SPDX-License-Identifier: Apache-2.0
// Norms that see NaN. std::max and Eigen's maxCoeff drop it, and a diverged run then reports error 0.

#ifndef DLCS_CORE_LINALG_NORMS_H_
#define DLCS_CORE_LINALG_NORMS_H_

#include <Eigen/Core>
#include <cmath>

#include "core/types.h"

namespace dlcs {

// The larger of two numbers; NaN if either is.
inline double NanMax(double a, double b) { return a > b || std::isnan(a) ? a : b; }

// max |entry|; 0 for an empty expression, NaN if any entry is NaN.
template <typename Derived>
double MaxAbs(const Eigen::DenseBase<Derived>& values) {
  if (values.size() == 0) return 0;
  return values.derived().cwiseAbs().template maxCoeff<Eigen::PropagateNaN>();
}

// max |entry| of each row; NaN for a row that holds one.
template <typename Derived>
Vector RowMaxAbs(const Eigen::MatrixBase<Derived>& matrix) {
  Vector result(matrix.rows());
  for (Index i = 0; i < matrix.rows(); ++i) result[i] = MaxAbs(matrix.row(i));
  return result;
}

// ‖A‖_∞, the largest absolute row sum; NaN if any entry is NaN.
template <typename Derived>
double InfinityNorm(const Eigen::MatrixBase<Derived>& matrix) {
  if (matrix.size() == 0) return 0;
  return matrix.cwiseAbs().rowwise().sum().template maxCoeff<Eigen::PropagateNaN>();
}

// max |min(y, w)|, the natural residual of y >= 0, w >= 0, yᵀw = 0; NaN if any entry is NaN.
template <typename Y, typename W>
double NaturalResidual(const Eigen::MatrixBase<Y>& y, const Eigen::MatrixBase<W>& w) {
  return MaxAbs(y.binaryExpr(w, [](double a, double b) { return a < b || std::isnan(a) ? a : b; }));
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_NORMS_H_
