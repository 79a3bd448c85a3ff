// SPDX-License-Identifier: Apache-2.0
// The sizes of the rows of large arrays.

#ifndef DLCS_CORE_LINALG_ROW_SIZES_H_
#define DLCS_CORE_LINALG_ROW_SIZES_H_

#include <Eigen/Core>

#include "core/types.h"

namespace dlcs {

// Raises `sizes` to max |entry| of each row of `values`; a NaN stays. Goes by columns, as they lie in memory.
template <typename Derived>
void RaiseRowMaxAbs(const Eigen::MatrixBase<Derived>& values, Vector& sizes) {
  for (Index j = 0; j < values.cols(); ++j) {
    sizes = sizes.binaryExpr(values.col(j).cwiseAbs(), [](double a, double b) { return a >= b || a != a ? a : b; });
  }
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_ROW_SIZES_H_
