// SPDX-License-Identifier: Apache-2.0
// The complete search for hidden Z-matrices of small size.

#ifndef DLCS_CORE_MATRIX_CLASSES_HIDDEN_Z_CHOICES_H_
#define DLCS_CORE_MATRIX_CLASSES_HIDDEN_Z_CHOICES_H_

#include <optional>

#include "core/types.h"

namespace dlcs {

// Column j of an X of (4.10) lies in K_j = { x : x_i <= 0, (Mx)_i <= 0, i != j }, and some gᵀx_j > 0 for all
// j, g = r + Mᵀs. So g must need e_j or row j of M to be a nonnegative combination of the e_i and the rows of
// M, for every j; generic g are combinations of n of them then, one for each j: r_j s_j = 0 may be assumed.
// For such a choice, with s_j > 0 for j in `alpha` and the rows e_j or M_j chosen as the rows of G, let U = G
// X. It is a Z-matrix, and wᵀU > 0 for some w > 0 (made of r and s) exactly when U is an M-matrix; after
// scaling of columns, exactly when U e > 0. So hidden Z means: for some alpha there is an X with columns in
// K_j and G X e > 0, a linear program.
//
// `M`: entries of size one, n <= 31. Linear programs with about n² variables and rows.

// Such an X, with a margin of at least 1e-7 for every inequality where -1 <= X <= 1 (rows of M that are zero
// need none); absent where there is none.
std::optional<Matrix> HiddenZMatrixForChoice(const Matrix& M, unsigned alpha);

// Whether there is none, proven: Gᵀw, w >= 0, w != 0, is a combination of the e_i and M_i, i != j, for every
// j, and so (Gᵀw)ᵀX <= 0. Solved with a margin that is beyond all rounding; absent proofs say nothing.
bool HiddenZChoiceIsImpossible(const Matrix& M, unsigned alpha);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_HIDDEN_Z_CHOICES_H_
