// SPDX-License-Identifier: Apache-2.0
// Factors of a matrix that may be singular.

#ifndef DLCS_CORE_LINALG_PSEUDO_INVERSE_H_
#define DLCS_CORE_LINALG_PSEUDO_INVERSE_H_

#include "core/linalg/decompositions.h"
#include "core/types.h"

namespace dlcs {

// A complete orthogonal decomposition: its solve() applies the pseudo-inverse. Pivots below 1e-11 of the largest one
// count as zero. All code for the least-norm solution uses this one criterion for singular blocks of M.
inline Eigen::CompleteOrthogonalDecomposition<Matrix> FactorOfAnyRank(const Matrix& matrix) {
  Eigen::CompleteOrthogonalDecomposition<Matrix> factor;
  factor.setThreshold(1e-11);
  factor.compute(matrix);
  return factor;
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_PSEUDO_INVERSE_H_
