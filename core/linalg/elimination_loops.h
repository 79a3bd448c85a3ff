// SPDX-License-Identifier: Apache-2.0
// The inner loops of dense elimination, for whatever registers the processor has.

#ifndef DLCS_CORE_LINALG_ELIMINATION_LOOPS_H_
#define DLCS_CORE_LINALG_ELIMINATION_LOOPS_H_

#include "core/types.h"

namespace dlcs {

// y -= factor x, for `count` entries; the second for many.
void SubtractLongMultiple(Index count, double factor, const double* x, double* y);
inline void SubtractMultiple(Index count, double factor, const double* x, double* y) {
  constexpr Index kLong = 16;  // shorter ones are done before a call is
  if (count >= kLong) return SubtractLongMultiple(count, factor, x, y);
  for (Index i = 0; i < count; ++i) y[i] -= factor * x[i];
}

// A -= L U, with A rows × columns, L rows × depth, U depth × columns, all column-major; columns of X are X_stride
// apart. Each entry of A takes its `depth` products one after the other, in order: blocks give the bits of single
// updates.
void SubtractProduct(Index rows, Index columns, Index depth, const double* L, Index L_stride, const double* U,
                     Index U_stride, double* A, Index A_stride);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_ELIMINATION_LOOPS_H_
