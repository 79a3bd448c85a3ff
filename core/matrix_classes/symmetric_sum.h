// SPDX-License-Identifier: Apache-2.0
// The quadratic form zᵀMz without the benefit of rounding.

#ifndef DLCS_CORE_MATRIX_CLASSES_SYMMETRIC_SUM_H_
#define DLCS_CORE_MATRIX_CLASSES_SYMMETRIC_SUM_H_

#include "core/types.h"

namespace dlcs {

// M + Mᵀ with every entry rounded downwards, and whether none of them had to be.
struct SymmetricSum {
  Matrix below;
  bool exact = true;
};
SymmetricSum SymmetricSumBelow(const Matrix& M);

// Whether zᵀMz < 0 beyond the rounding of its own sum.
bool FormIsClearlyNegative(const Matrix& M, const Vector& z);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_SYMMETRIC_SUM_H_
