// SPDX-License-Identifier: Apache-2.0
// The quadratic form yᵀMy of a matrix that need not be symmetric.

#ifndef DLCS_CORE_MATRIX_CLASSES_POSITIVE_SEMIDEFINITE_H_
#define DLCS_CORE_MATRIX_CLASSES_POSITIVE_SEMIDEFINITE_H_

#include <optional>

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// Whether yᵀMy >= 0 for all y, with the reason or a witness. Exact zeros are kept: entries of the symmetric
// part that cancel to rounding are zero (a skew matrix is positive semidefinite), and a zero on its diagonal
// needs a zero row. What remains is scaled to unit diagonal and judged by its smallest eigenvalue, down to
// -n·1e-15 times the largest. Never unknown. No comes with `witness.z`, whose form is negative but for
// rounding. O(n³).
Fact TestPositiveSemidefinite(const Matrix& M);

// The smallest eigenvalue of (M + Mᵀ)/2 if that matrix is positive definite beyond rounding (after scaling to
// unit diagonal); absent otherwise.
std::optional<double> SmallestEigenvalueIfDefinite(const Matrix& M);

bool IsSymmetricPartPositiveDefinite(const Matrix& M);

// M + Mᵀ with every entry rounded downwards, and whether none of them had to be.
struct SymmetricSum {
  Matrix below;
  bool exact = true;
};
SymmetricSum SymmetricSumBelow(const Matrix& M);

// Whether zᵀMz < 0 beyond the rounding of its own sum.
bool FormIsClearlyNegative(const Matrix& M, const Vector& z);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_POSITIVE_SEMIDEFINITE_H_
