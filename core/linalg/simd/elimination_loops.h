// SPDX-License-Identifier: Apache-2.0
// The inner loops of dense elimination, vectorized for the instruction set of the processor.

#ifndef DLCS_CORE_LINALG_SIMD_ELIMINATION_LOOPS_H_
#define DLCS_CORE_LINALG_SIMD_ELIMINATION_LOOPS_H_

#include <span>

#include "core/types.h"

namespace dlcs {

inline constexpr Index kLongLoop = 16;  // shorter loops are inlined, since a call would take longer

// y -= factor x, for `count` entries; the second for many.
void SubtractLongMultiple(Index count, double factor, const double* x, double* y);
inline void SubtractMultiple(Index count, double factor, const double* x, double* y) {
  if (count >= kLongLoop) return SubtractLongMultiple(count, factor, x, y);
  for (Index i = 0; i < count; ++i) y[i] -= factor * x[i];
}

// A -= L U, with A rows × columns, L rows × depth, U depth × columns, all column-major; columns of X are X_stride
// apart. The `depth` products of each entry of A are subtracted in order, so blocks give the same bits as single
// updates.
void SubtractProduct(Index rows, Index columns, Index depth, const double* L, Index L_stride, const double* U,
                     Index U_stride, double* A, Index A_stride);

// w += Σ_k x_k (column columns[k] of M), k increasing; M column-major, its columns `rows` apart. The second for many
// rows.
void AddLongColumns(Index rows, std::span<const Index> columns, const double* x, const double* M, double* w);
inline void AddColumns(Index rows, std::span<const Index> columns, const double* x, const double* M, double* w) {
  if (rows >= kLongLoop) return AddLongColumns(rows, columns, x, M, w);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    for (Index i = 0; i < rows; ++i) w[i] += x[k] * M[columns[k] * rows + i];
  }
}

// Gaussian elimination in the columns [begin, end) of the size × size matrix `LU`, columns LU_stride apart, those
// before being done: each pivot is the largest entry of its column, rows are exchanged in all columns and in `source`,
// multipliers take the place of zeros. inverse[p] becomes 1 over pivot p. False where a pivot is not larger than
// `zero`.
bool EliminateColumns(Index begin, Index end, Index size, double zero, double* LU, Index LU_stride, double* inverse,
                      Index* source);

// x := L⁻¹ x, L the unit lower triangle of LU, size × size, columns LU_stride apart. The second for many, by blocks.
void SubstituteLongForward(Index size, const double* LU, Index LU_stride, double* x);
inline void SubstituteForward(Index size, const double* LU, Index LU_stride, double* x) {
  if (size >= kLongLoop) return SubstituteLongForward(size, LU, LU_stride, x);
  for (Index p = 0; p + 1 < size; ++p) SubtractMultiple(size - p - 1, x[p], LU + p * LU_stride + p + 1, x + p + 1);
}

// x := U⁻¹ x, U the upper triangle, `inverse` the `size` numbers 1 over its diagonal. The second for many, by blocks.
void SubstituteLongBackward(Index size, const double* LU, Index LU_stride, const double* inverse, double* x);
inline void SubstituteBackward(Index size, const double* LU, Index LU_stride, const double* inverse, double* x) {
  if (size >= kLongLoop) return SubstituteLongBackward(size, LU, LU_stride, inverse, x);
  for (Index p = size - 1; p >= 0; --p) {
    x[p] *= inverse[p];
    SubtractMultiple(p, x[p], LU + p * LU_stride, x);
  }
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SIMD_ELIMINATION_LOOPS_H_
