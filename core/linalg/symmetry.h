// SPDX-License-Identifier: Apache-2.0
// Symmetry of sparse matrices.

#ifndef DLCS_CORE_LINALG_SYMMETRY_H_
#define DLCS_CORE_LINALG_SYMMETRY_H_

#include "core/linalg/structured_matrix.h"

namespace dlcs {

// Whether M = Mᵀ, to the bit; not where an entry is NaN. Cost: the nonzeros.
bool IsSymmetric(const SparseMatrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SYMMETRY_H_
