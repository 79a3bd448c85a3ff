// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/symmetry.h"

namespace dlcs {

bool IsSymmetric(const SparseMatrix& M) {
  if (M.rows() != M.cols()) return false;
  const SparseMatrix difference = M - SparseMatrix(M.transpose());
  for (Index k = 0; k < difference.nonZeros(); ++k) {
    if (difference.valuePtr()[k] != 0) return false;  // NaN counts as different
  }
  return true;
}

}  // namespace dlcs
