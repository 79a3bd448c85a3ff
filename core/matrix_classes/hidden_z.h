// SPDX-License-Identifier: Apache-2.0
// Hidden Z-matrices: (4.10) of [Chen & Xiang 2013].

#ifndef DLCS_CORE_MATRIX_CLASSES_HIDDEN_Z_H_
#define DLCS_CORE_MATRIX_CLASSES_HIDDEN_Z_H_

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// Whether Z-matrices X, Y with X nonsingular and r, s >= 0 exist such that M X = Y and rᵀX + sᵀY > 0, for `M`
// square and finite, n >= 1.
//
// X = I proves it for Z-matrices of any size. For n <= 6 the search tries all 2ⁿ choices of r_j = 0 or s_j = 0
// (hidden_z_choices.h); it misses only matrices on the boundary of the class. For n <= 20 it looks for X column by
// column, each a linear program, for some (r, s): (e, 0), (0, e) (X = M⁻¹ where that is a Z-matrix), columns that
// maximize x_jj + y_jj with the best (r, s) for these, and 20 pairs drawn with a fixed seed. Off-diagonal signs have
// a margin beyond all rounding, except in rows of M that are zero.
//
// Yes comes with X, Y, r, s in the witness: the signs of X hold exactly; Y is MX to rounding, and the signs
// of the exact MX are those of Y; det X is not zero and rᵀX + sᵀY is positive beyond rounding.
//
// No is said where some column j is impossible for every (r, s), because neither x_jj nor (MX)_jj can be
// positive, of which one would have to be. Then `witness.indices` = {j}; `witness.r` = w >= 0, w_j = 0, has
// wᵀM <= 0 but for (wᵀM)_j > 0 (so x_jj <= 0); and `witness.s` = v >= 0, v_j = 0, has vᵀM <= row j of M (so
// (MX)_jj <= 0). For n <= 6 it is also said where each of the 2ⁿ choices is excluded by a combination of its
// own; these are too many to return, so there is no witness. Otherwise unknown.
//
// At most 2ⁿ⁺¹ linear programs with n² variables for n <= 6, 25 n with n variables for n <= 20.
Fact TestHiddenZ(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_HIDDEN_Z_H_
