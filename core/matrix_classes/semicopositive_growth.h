// SPDX-License-Identifier: Apache-2.0
// Strictly semicopositive matrices that are not of type III, hence neither of type II nor I.

#ifndef DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_GROWTH_H_
#define DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_GROWTH_H_

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// Whether M is of type III, section 4 of [Shen & Pang 2007]: no or unknown. `M` square, finite, strictly
// semicopositive. Types 0 to III are the same for n = 2 (Proposition 4); from n = 3 on they are not: I - ρC
// with C a cyclic permutation is an M-matrix for ρ < 1, and not of type III for ρ > 0.945 (n = 3).
//
// Looks for a nondecreasing v along which no ∫ v_i' (Mv)_i dτ is positive. In one round the entries of z > 0
// grow one after the other from z_i to λ z_i, λ > 1, in a fixed order; the round before was the same divided
// by λ, and so on back to v(0) = 0. The integrals over a round are, but for the factor (λ - 1) z_i > 0, the
// entries of
//
//     (½ (λ + 1) D + λ L + U) z,     M = D + L + U,
//
// with L the entries whose column has grown before its row. So M is not of type III if this matrix is not
// strictly semicopositive for some λ and some order. Tried are the (n - 1)! orders that are not rotations of
// another for n <= 6, and 100 drawn with a fixed seed for n <= 12, with λ = 5/4, 3/2, 2, 3, 4, 6, 10.
//
// No comes with `witness.indices` = S, `witness.z` = z >= 0 of |S| entries, z != 0, `witness.value` = λ, and
// `witness.r` of |S| entries: the place of each index in the order. The entries above are not positive,
// whatever the rounding.
Fact RefuteTypeThree(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_GROWTH_H_
