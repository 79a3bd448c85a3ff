// SPDX-License-Identifier: Apache-2.0
// |A| v, for bounds of sums.

#ifndef DLCS_CORE_LINALG_ABS_TIMES_H_
#define DLCS_CORE_LINALG_ABS_TIMES_H_

#include "core/types.h"

namespace dlcs {

// |A| v, without a copy of |A|.
inline Vector AbsTimes(const Matrix& A, const Eigen::Ref<const Vector>& v) {
  Vector sums = Vector::Zero(A.rows());
  for (Index j = 0; j < A.cols(); ++j) sums += A.col(j).cwiseAbs() * v[j];
  return sums;
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_ABS_TIMES_H_
