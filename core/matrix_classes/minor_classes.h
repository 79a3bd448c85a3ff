// SPDX-License-Identifier: Apache-2.0
// The classes that the signs of the principal minors make.

#ifndef DLCS_CORE_MATRIX_CLASSES_MINOR_CLASSES_H_
#define DLCS_CORE_MATRIX_CLASSES_MINOR_CLASSES_H_

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// Definitions as printed in section 1 of [Chen & Xiang 2013].
struct MinorClasses {
  Fact nondegenerate;  // all principal minors are nonzero
  Fact p;              // all are positive
  Fact p0;             // all are nonnegative
  Fact n;              // all are negative
  Fact np;             // each of order k has the sign (-1)^k
  Fact pn;             // each of order k has the sign (-1)^(k+1)
};

// The classes of `M`, square and finite, n >= 1. For n <= 20 all principal minors are visited, once. A no
// comes with the minor that refutes it: `witness.indices` = S and `witness.value` = det M_SS; a yes of that
// size with the minor that is smallest in magnitude; unknown when rounding could decide a sign and no other
// minor refutes. Entries are taken as they stand.
//
// Beyond n = 20 minors of order one and two and of fixed reorderings say no; H-matrices with positive
// diagonal and positive definite ones are P, P0 and nondegenerate; NP means that -M is P; otherwise unknown.
// A yes has then no witness. O(2ⁿ) up to 20, O(n³) beyond.
MinorClasses ClassifyByMinors(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_MINOR_CLASSES_H_
