// SPDX-License-Identifier: Apache-2.0
// Hidden Z-matrices: (4.10) of [Chen & Xiang 2013].

#ifndef DLCS_CORE_ANALYSIS_HIDDEN_Z_H_
#define DLCS_CORE_ANALYSIS_HIDDEN_Z_H_

#include "core/analysis/fact.h"
#include "core/types.h"

namespace dlcs {

// Whether Z-matrices X, Y with X nonsingular and r, s >= 0 exist such that M X = Y and rᵀX + sᵀY > 0, for `M`
// square and finite, n >= 1.
//
// For fixed (r, s) each column of X is a linear program of its own. Tried, in this order: X = I, which serves
// Z-matrices of any size; the pairs (e, 0) and (0, e) (X = M⁻¹ where that is a Z-matrix); columns that
// maximise x_jj + y_jj, and for these the best (r, s), which is a linear program too; 20 pairs with r_i s_i =
// 0, which suffices, drawn with a fixed seed. Off-diagonal signs are asked for with a margin beyond all
// rounding, but for rows of M that are zero: so members on the boundary may be missed.
//
// Yes comes with X, Y, r, s in the witness: the signs of X hold exactly; Y is MX to rounding, and the signs
// of the exact MX are those of Y; det X is not zero and rᵀX + sᵀY is positive beyond rounding.
//
// No is said where some column j is impossible for every (r, s), because neither x_jj nor (MX)_jj can be
// positive, of which one would have to be. Then `witness.indices` = {j}; `witness.r` = w >= 0, w_j = 0, has
// wᵀM <= 0 but for (wᵀM)_j > 0 (so x_jj <= 0); and `witness.s` = v >= 0, v_j = 0, has vᵀM <= row j of M (so
// (MX)_jj <= 0). Otherwise unknown: the search is no proof.
//
// Up to 23 n linear programs with n variables, for n <= 20; beyond, only X = I is tried.
Fact TestHiddenZ(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_HIDDEN_Z_H_
