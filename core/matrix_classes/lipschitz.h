// SPDX-License-Identifier: Apache-2.0
// Lipschitz constants of solutions of LCP(q, M) as functions of q, in the ∞-norm.

#ifndef DLCS_CORE_MATRIX_CLASSES_LIPSCHITZ_H_
#define DLCS_CORE_MATRIX_CLASSES_LIPSCHITZ_H_

#include <optional>
#include <string>

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// A number with its quality. `why` says how it was found, or why it is absent.
struct LipschitzBound {
  std::optional<double> value;
  ConstantKind kind = ConstantKind::kExact;
  std::string why;
};

// 𝓛 = max ‖(M_SS)⁻¹‖_∞ over the nonsingular principal submatrices of M, 0 if there is none: (2.12) and (2.15) of
// [Chen & Xiang 2013] X. Chen, S. Xiang. Newton iterations in implicit time-stepping scheme for differential linear
// complementarity systems. Math. Programming 138, 579-606. L of (2.3), for nondegenerate M, is the same number.
//
// Exact for n <= 12 (2ⁿ inverses) and for M-matrices (‖M⁻¹‖_∞). Beyond, an upper bound: for an H-matrix with positive
// diagonal (diagonally dominant ones among them) ‖⟨M⟩⁻¹‖_∞ with ⟨M⟩ the comparison matrix; for a positive definite
// symmetric part √n / λ_min. Otherwise absent.
//
// It is also the bound (2.6), max ‖(I - D + D M)⁻¹ D‖ over diagonal D with entries in [0, 1], of a P-matrix: as a
// function of one d_i the matrix is a quotient of affine functions with one positive denominator, det(I - D + D M),
// so its norm (any norm) is quasi-convex in d_i and largest for d_i = 0 or 1; there it is ‖(M_SS)⁻¹‖. The paper calls
// (2.5) sharper than (2.6): the two are equal.
LipschitzBound BoundLipschitz(const Matrix& M);

// The value of BoundLipschitz().
std::optional<double> LipschitzConstant(const Matrix& M);

// max ‖(M_SS)⁺‖_∞ over all principal submatrices, ⁺ the pseudo-inverse; for nondegenerate M this is 𝓛. Every piece of
// the least-norm solution of a positive semidefinite LCP is y_S = -(M_SS)⁺ q_S (core/lcp/dense/least_norm.h): where the
// solution changes by more than this times the change of q, it has jumped. n <= 12, absent beyond.
std::optional<double> LargestSlope(const Matrix& M);

// The constant (2.14) of Mangasarian & Shiau as [Chen & Xiang] print it,
//
//     v_∞(M) = sup { ‖u‖_1 : ‖uᵀP‖_1 = 1, rows of P = (M; I) where u_i != 0 linearly independent }.
//
// Independent rows are part of a basis of n rows B, and for those sup ‖B⁻ᵀz‖_1 over ‖z‖_1 = 1 is ‖B⁻¹‖_∞: the maximum
// of that over all nonsingular B is found by enumeration for n <= 8 (12,870 bases). Beyond, max(1, 𝓛) as a lower
// bound (Proposition 2.1) where 𝓛 is exact, otherwise 1: B = I.
LipschitzBound MangasarianShiauConstant(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_LIPSCHITZ_H_
