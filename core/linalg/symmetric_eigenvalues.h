// SPDX-License-Identifier: Apache-2.0
// The eigenvalues of a symmetric matrix, by a computation that can be stopped.

#ifndef DLCS_CORE_LINALG_SYMMETRIC_EIGENVALUES_H_
#define DLCS_CORE_LINALG_SYMMETRIC_EIGENVALUES_H_

#include "core/types.h"

namespace dlcs {

// All of them, increasing; the lower triangle of `matrix` is read. NaN where an entry is not finite. Checks for a stop
// (core/parallel/stop_scope.h) before every reflection of the reduction to tridiagonal form. Cost: 4/3 n³ operations.
Vector SymmetricEigenvalues(const Matrix& matrix);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SYMMETRIC_EIGENVALUES_H_
