// SPDX-License-Identifier: Apache-2.0
// Norms that propagate NaN. std::max and Eigen's maxCoeff drop it, and a diverged run would then report error 0.

#ifndef DLCS_CORE_LINALG_NORMS_H_
#define DLCS_CORE_LINALG_NORMS_H_

#include <Eigen/Core>
#include <cmath>
#include <type_traits>

#include "core/types.h"

namespace dlcs {

// The larger of two numbers; NaN if either is.
inline double NanMax(double a, double b) { return a > b || std::isnan(a) ? a : b; }
// Entry by entry.
inline Vector NanMax(const Vector& a, const Vector& b) {
  return a.binaryExpr(b, [](double of_a, double of_b) { return NanMax(of_a, of_b); });
}

// The largest error[i] / allowed[i], where an error of zero has the ratio zero.
inline double LargestRatio(const Vector& error, const Vector& allowed) {
  double largest = 0;
  for (Index i = 0; i < error.size(); ++i) largest = NanMax(largest, error[i] == 0 ? 0 : error[i] / allowed[i]);
  return largest;
}

// max |entry| of `rows` × `cols` numbers, columns of which are `stride` apart; 0 where there are none, NaN if any is
// NaN.
double MaxAbsOfColumns(const double* values, Index rows, Index cols, Index stride);

// Whether an expression is an array of doubles in memory, column by column.
template <typename Derived>
constexpr bool kIsInMemory = (Derived::Flags & Eigen::DirectAccessBit) != 0 && !Derived::IsRowMajor
                             && std::is_same_v<typename Derived::Scalar, double>;

// max |entry|; 0 for an empty expression, NaN if any entry is NaN.
template <typename Derived>
double MaxAbs(const Eigen::DenseBase<Derived>& values) {
  if (values.size() == 0) return 0;
  if constexpr (kIsInMemory<Derived>) {
    const Derived& stored = values.derived();
    if (stored.innerStride() == 1) {
      return MaxAbsOfColumns(stored.data(), stored.rows(), stored.cols(), stored.outerStride());
    }
  }
  return values.derived().cwiseAbs().template maxCoeff<Eigen::PropagateNaN>();
}

// Raises sizes[i] to max |entry| of row i of such numbers; a NaN stays.
void RaiseRowMaxAbsOfColumns(const double* values, Index rows, Index cols, Index stride, double* sizes);

// Raises `sizes` to max |entry| of each row; a NaN stays. Loops over columns, in the order of memory.
template <typename Derived>
void RaiseRowMaxAbs(const Eigen::MatrixBase<Derived>& matrix, Vector& sizes) {
  if constexpr (kIsInMemory<Derived>) {
    const Derived& stored = matrix.derived();
    if (stored.innerStride() == 1) {
      return RaiseRowMaxAbsOfColumns(stored.data(), stored.rows(), stored.cols(), stored.outerStride(), sizes.data());
    }
  }
  for (Index j = 0; j < matrix.cols(); ++j) {
    sizes = sizes.binaryExpr(matrix.col(j).cwiseAbs(), [](double a, double b) { return a >= b || a != a ? a : b; });
  }
}

// max |entry| of each row; NaN for a row that holds one.
template <typename Derived>
Vector RowMaxAbs(const Eigen::MatrixBase<Derived>& matrix) {
  Vector sizes = Vector::Zero(matrix.rows());
  RaiseRowMaxAbs(matrix, sizes);
  return sizes;
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
