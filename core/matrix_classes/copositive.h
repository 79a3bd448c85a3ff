// SPDX-License-Identifier: Apache-2.0
// Copositive matrices.

#ifndef DLCS_CORE_MATRIX_CLASSES_COPOSITIVE_H_
#define DLCS_CORE_MATRIX_CLASSES_COPOSITIVE_H_

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

struct CopositiveClasses {
  Fact strictly_copositive;  // zᵀMz > 0 for all z >= 0, z != 0
  Fact copositive;           // zᵀMz >= 0 for all z >= 0
};

// Both classes of `M`, square and finite, n >= 1, that need not be symmetric.
//
// A symmetric matrix is (strictly) copositive exactly when it is (strictly) semicopositive [Cottle, Pang &
// Stone 1992, Proposition 3.9.14]: ClassifySemicopositive() is asked of M + Mᵀ, where sums that are rounded
// are rounded downwards, which a yes survives. No comes with `witness.indices` = S, `witness.z` >= 0 of |S|
// entries, z != 0, and `witness.value` = zᵀM_SS z, not positive (strict) or negative, beyond rounding or
// exactly. Unknown where rounding could decide, or n > 20 and no other test decides. Cost as there.
CopositiveClasses ClassifyCopositive(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_COPOSITIVE_H_
