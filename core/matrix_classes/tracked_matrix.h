// SPDX-License-Identifier: Apache-2.0
// A matrix in elimination that knows how far rounding may have moved its entries.

#ifndef DLCS_CORE_MATRIX_CLASSES_TRACKED_MATRIX_H_
#define DLCS_CORE_MATRIX_CLASSES_TRACKED_MATRIX_H_

#include <cmath>
#include <limits>

#include "core/types.h"

namespace dlcs {

// Entries and bounds of their absolute errors, carried to first order. The unit is twice the rounding of one
// operation, which leaves room for the terms of second order as long as pivots are clear.
struct TrackedMatrix {
  Matrix value;
  Matrix error;

  static constexpr double kRounding = std::numeric_limits<double>::epsilon();

  // The matrix as it stands, and the matrix with rounding that may already sit in the entries of the caller.
  static TrackedMatrix Exactly(const Matrix& M) { return {M, Matrix::Zero(M.rows(), M.cols())}; }
  static TrackedMatrix Rounded(const Matrix& M) { return {M, kRounding * M.cwiseAbs()}; }

  bool PivotIsPositive() const { return value(0, 0) > error(0, 0); }

  // Whether the first diagonal entry is known well enough to divide by it.
  bool PivotIsClear() const { return std::abs(value(0, 0)) > 1e6 * error(0, 0); }

  // The Schur complement of the first diagonal entry.
  void EliminateInto(TrackedMatrix& schur) const {
    const Index size = value.rows() - 1;
    const double pivot = value(0, 0);
    const double pivot_error = error(0, 0) / std::abs(pivot) + 2 * kRounding;
    for (Index j = 0; j < size; ++j) {
      const double up = value(0, j + 1) / pivot;
      const double up_error = error(0, j + 1) / std::abs(pivot);
      for (Index i = 0; i < size; ++i) {
        const double left = value(i + 1, 0);
        const double product = left * up;
        const double entry = value(i + 1, j + 1) - product;
        schur.value(i, j) = entry;
        schur.error(i, j) = error(i + 1, j + 1) + std::abs(left) * up_error + error(i + 1, 0) * std::abs(up) +
                            std::abs(product) * pivot_error + kRounding * std::abs(entry);
      }
    }
  }

  // The rest without the first row and column.
  void DropInto(TrackedMatrix& rest) const {
    const Index size = value.rows() - 1;
    rest.value = value.bottomRightCorner(size, size);
    rest.error = error.bottomRightCorner(size, size);
  }
};

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_TRACKED_MATRIX_H_
