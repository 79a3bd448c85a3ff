// SPDX-License-Identifier: Apache-2.0
// Factors of a matrix that may be singular.

#ifndef DLCS_CORE_LINALG_PSEUDO_INVERSE_H_
#define DLCS_CORE_LINALG_PSEUDO_INVERSE_H_

#include <Eigen/QR>

#include "core/types.h"

namespace dlcs {

// A complete orthogonal decomposition: its solve() applies the pseudo-inverse. What is below 1e-11 of the largest pivot
// counts as zero: wherever blocks of M are singular for the least norm, they are singular by this one measure.
inline Eigen::CompleteOrthogonalDecomposition<Matrix> FactorOfAnyRank(const Matrix& matrix) {
  Eigen::CompleteOrthogonalDecomposition<Matrix> factor;
  factor.setThreshold(1e-11);
  factor.compute(matrix);
  return factor;
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_PSEUDO_INVERSE_H_
