// SPDX-License-Identifier: Apache-2.0
// Strictly semicopositive matrices of type I: section 4 of [Shen & Pang 2007].

#ifndef DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_TYPES_H_
#define DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_TYPES_H_

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

// Whether M is strictly semicopositive of type I: for some σ > 0 and t̄ > 0, all nondecreasing v with v(0) = 0
// and all t <= t̄,  max_i ∫_0^t v_i' (Mv)_i dτ >= σ ‖v(t)‖². `M` square, finite, n >= 1; `strict` is the fact
// that it is strictly semicopositive, ClassifySemicopositive(M).strict.
//
// Yes for n <= 2 where `strict` holds (Proposition 4), and where weights f > 0 are found for which the
// symmetric matrix
//
//     K_ii = f_i m_ii,     K_ij = min(f_i m_ij, f_j m_ji)
//
// is strictly copositive: since ∫v_i'v_j lies between 0 and v_i v_j, and ∫v_i'v_j + ∫v_j'v_i = v_i v_j,
//
//     Σ_i f_i ∫ v_i' (Mv)_i dτ >= ½ v(t)ᵀ K v(t).
//
// With f = e this contains Proposition 3 (a) to (d); other weights give its DME (rows and columns scaled to a
// matrix of (a) to (d)): D M E is symmetric for some D, E exactly when f_i m_ij = f_j m_ji for f = d/e. Tried
// are f = e; the f that makes M symmetric, if there is one; and y/x, Ñx = e, Ñᵀy = e, where Ñ, the negative
// entries of M with half its diagonal (then they serve) or all of it, is an M-matrix. `witness.z` = f.
//
// No, with the witness of `strict`, where M is not strictly semicopositive, which type I implies; and with
// that of RefuteTypeThree() where it is not even of type III. So every answer is that for types II and III as
// well. Otherwise unknown: no test is known that decides.
Fact TestSemicopositiveTypeI(const Matrix& M, const Fact& strict);
Fact TestSemicopositiveTypeI(const Matrix& M);

// The matrix K of weights `f`, with every entry rounded downwards.
Matrix TypeIComparison(const Matrix& M, const Vector& f);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_TYPES_H_
