// SPDX-License-Identifier: Apache-2.0
// The sign of the quadratic form yᵀMy, without the benefit of rounding.

#ifndef DLCS_CORE_MATRIX_CLASSES_QUADRATIC_FORM_H_
#define DLCS_CORE_MATRIX_CLASSES_QUADRATIC_FORM_H_

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

struct QuadraticFormClasses {
  Fact positive_definite;      // yᵀMy > 0 for all y != 0
  Fact positive_semidefinite;  // yᵀMy >= 0 for all y
};

// The questions of core/matrix_classes/positive_semidefinite.h for `M` as it stands: unknown at the boundary. Yes for
// positive definite comes with `witness.value`, the smallest eigenvalue of (M + Mᵀ)/2; no with `witness.z` !=
// 0 and `witness.value` = zᵀMz (negative beyond rounding, or not positive exactly). Where only exact minors
// of the symmetric part decide (n <= 20), a no comes with `witness.indices` = S and `witness.value` = det ((M
// + Mᵀ)/2)_SS. O(n³), or O(2ⁿ) at the boundary.
QuadraticFormClasses ClassifyQuadraticForm(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_QUADRATIC_FORM_H_
