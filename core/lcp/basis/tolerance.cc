// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis/tolerance.h"

#include "core/linalg/norms.h"

namespace dlcs {

Vector SizeOfSums(const StructuredMatrix& N, const Eigen::Ref<const Matrix>& x, const Eigen::Ref<const Matrix>& g) {
  return N.AbsTimes(RowMaxAbs(x)) + RowMaxAbs(g);
}

}  // namespace dlcs
