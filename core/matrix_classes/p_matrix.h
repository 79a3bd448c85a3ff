// SPDX-License-Identifier: Apache-2.0
// Is every principal minor of a matrix positive?

#ifndef DLCS_CORE_MATRIX_CLASSES_P_MATRIX_H_
#define DLCS_CORE_MATRIX_CLASSES_P_MATRIX_H_

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// Whether the square, finite matrix `M` is a P-matrix, with the reason or a witness.
//
// Tries, in this order: diagonal entries and 2×2 minors (no); Z-matrix (yes exactly when it is a nonsingular
// M-matrix); H-matrix with positive diagonal, which includes diagonal dominance after any column scaling
// (yes); positive definite symmetric part (yes); for n <= kMaxExactSize all 2ⁿ - 1 minors; beyond, the
// leading minors of M and of a few fixed reorderings (no), otherwise unknown.
//
// A minor that is zero to working precision counts as not positive: a running error bound decides, so the
// answer does not depend on the scaling of M. No comes with `witness.indices` = S; `witness.value` = det M_SS
// is set only where that minor is not positive beyond rounding. (ProfileOf() in core/matrix_classes/class_profile.h
// answers unknown where this test, which has to choose a rule for a solver, says "not positive" by rounding.)
Fact TestPMatrix(const Matrix& M);

inline constexpr Index kMaxExactSize = 20;

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_P_MATRIX_H_
