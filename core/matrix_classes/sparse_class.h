// SPDX-License-Identifier: Apache-2.0
// What is known about a large sparse matrix M of a linear complementarity problem.

#ifndef DLCS_CORE_MATRIX_CLASSES_SPARSE_CLASS_H_
#define DLCS_CORE_MATRIX_CLASSES_SPARSE_CLASS_H_

#include "core/linalg/structured_matrix.h"
#include "core/matrix_classes/class_facts.h"
#include "core/matrix_classes/fact.h"

namespace dlcs {

// Whether no off-diagonal entry is positive; no comes with a witness as that of the dense test. O(nonzeros).
Fact TestZMatrix(const SparseMatrix& M);

// Whether the Z-matrix `M` is a nonsingular M-matrix: it is exactly when some v > 0 has M v > 0 [Berman &
// Plemmons 1994, Theorem 6.2.3, I27]. v = M⁻¹ 1 is tried; M v > 0 is checked by arithmetic, beyond its
// rounding, and v is the witness. No where such a v has an entry that is not positive (M⁻¹ would be
// nonnegative), unknown where rounding hides the answer. One sparse LU.
Fact TestMMatrix(const SparseMatrix& M);

// Whether (M + Mᵀ)/2 is positive definite: by a sparse LDLᵀ, after scaling to unit diagonal and a shift by
// what rounding can make of the pivots [Rump 2006]. Never no: unknown where it is not proven.
//
// Source: [Rump 2006] S. M. Rump. Verification of positive definiteness. BIT 46, 433-452.
Fact TestPositiveDefinite(const SparseMatrix& M);

// The class of a square, finite, sparse `M`, without an O(n³) test: Z by sign; P for M-matrices, H-matrices
// with positive diagonal (whose comparison matrix is an M-matrix) and where the symmetric part is positive
// definite, no where a diagonal entry is not positive or a Z-matrix is no M-matrix, otherwise unknown;
// positive semidefinite where definite, zero, skew or diagonal with entries >= 0, no where a diagonal entry
// is negative, otherwise unknown. The Lipschitz constant is ‖M⁻¹‖_∞ of an M-matrix, ‖⟨M⟩⁻¹‖_∞ of an H-matrix,
// otherwise absent. Cost: a few sparse factorizations.
MatrixClass ClassifySparse(const SparseMatrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_SPARSE_CLASS_H_
