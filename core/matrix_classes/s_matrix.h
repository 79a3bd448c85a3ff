// SPDX-License-Identifier: Apache-2.0
// Is there a z >= 0 with Mz > 0?

#ifndef DLCS_CORE_MATRIX_CLASSES_S_MATRIX_H_
#define DLCS_CORE_MATRIX_CLASSES_S_MATRIX_H_

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs {

// Whether the square, finite `M` is an S-matrix. Yes comes with `witness.z` >= 0, Mz > 0; no with `witness.z`
// >= 0, z != 0, Mᵀz <= 0, which excludes it (Ville's theorem); both hold for the numbers returned whatever
// the rounding of their check. Unknown when the value of the matrix game is zero to working precision, or the
// linear program failed. Tries z = e and z = |M|⁻¹e of the comparison matrix first; then one linear program
// of n rows, for n <= 200.
Fact TestSMatrix(const Matrix& M);

// Whether z >= 0 and Mz > 0, whatever the rounding of Mz.
bool ImageIsPositive(const Matrix& M, const Vector& z);

// The largest Z-matrix that is nowhere above M: its diagonal, and its negative entries beside it.
Matrix ZMatrixBelow(const Matrix& M);

// Some z > 0 with Zz > 0 beyond rounding, where the Z-matrix `Z` is a nonsingular M-matrix; otherwise empty.
Vector PositiveImageOfMMatrix(const Matrix& Z);

// Whether M is a nonsingular M-matrix: a Z-matrix (`z` of TestZMatrix()) that is an S-matrix (`s` of
// TestSMatrix()). The witness is that of the one that decides.
Fact TestMMatrix(const Fact& z, const Fact& s);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_S_MATRIX_H_
