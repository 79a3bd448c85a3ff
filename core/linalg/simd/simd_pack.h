// SPDX-License-Identifier: Apache-2.0
// Eight columns side by side, for loops that run over them in lanes.

#ifndef DLCS_CORE_LINALG_SIMD_SIMD_PACK_H_
#define DLCS_CORE_LINALG_SIMD_SIMD_PACK_H_

#include "core/types.h"

namespace dlcs {

// lanes[width i + l] = entry i of column l, for `rows` entries of eight columns that are `stride` apart; and back.
void ColumnsToLanes(const double* columns, Index stride, Index rows, double* lanes, Index width);
void LanesToColumns(const double* lanes, Index width, Index rows, double* columns, Index stride);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SIMD_SIMD_PACK_H_
