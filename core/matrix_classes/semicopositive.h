// SPDX-License-Identifier: Apache-2.0
// Semicopositive and strictly semicopositive matrices.

#ifndef DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_H_
#define DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_H_

#include "core/matrix_classes/fact.h"
#include "core/matrix_classes/semicopositive_sweep.h"
#include "core/types.h"

namespace dlcs {

// Both classes of `M`, square and finite, n >= 1, whose entries are taken as they stand.
//
// Yes for matrices of any size without negative entries (strict: with positive diagonal), and where diag M
// with the negative entries of M beside it is an M-matrix: then `witness.z` = z > 0 has m_ii z_i > Σ_j max(0,
// -m_ij) z_j for all i, which is enough. Else, for n <= 20, all principal submatrices are looked at: a
// smallest M_SS that violates `weak` has a nonpositive inverse, one that violates `strict` a negative one, or
// is singular with an adjugate of one sign. The signs of the minors leave few candidates for this. Beyond n =
// 20, P-matrices are strictly semicopositive, and one linear program may say no.
//
// No comes with `witness.indices` = S and `witness.z` of |S| entries: for `strict` z >= 0, z != 0, M_SS z <=
// 0; for `weak` z > 0, M_SS z < 0; beyond rounding, or exactly where the product is exact. Unknown where
// rounding could decide, or n is too large. O(2ⁿ) up to n = 20, else polynomial.
//
// Sources: [Cottle, Pang & Stone 1992], section 3.9; for symmetric matrices K. P. Hadeler. On copositive
// matrices. Linear Algebra and its Applications 49 (1983), 79-89. That a smallest violating M_SS is as
// described: where M_SS z0 <= 0, z0 > 0, follow z0 - t M_SS⁻¹w, w >= 0, or z0 + t u, M_SS u = 0, to the
// boundary of the orthant; a point there other than zero would violate with fewer indices.
SemicopositiveClasses ClassifySemicopositive(const Matrix& M);

// The first of them alone.
inline Fact TestStrictlySemicopositive(const Matrix& M) { return ClassifySemicopositive(M).strict; }

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_H_
