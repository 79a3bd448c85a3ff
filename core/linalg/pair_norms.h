// SPDX-License-Identifier: Apache-2.0
// How far columns of pairs y_i, w_i are from complementary, in one pass.

#ifndef DLCS_CORE_LINALG_PAIR_NORMS_H_
#define DLCS_CORE_LINALG_PAIR_NORMS_H_

#include <Eigen/Core>

#include "core/types.h"

namespace dlcs {

// Maxima over all columns; each is NaN where an entry is.
struct PairNorms {
  double residual = 0;         // max |min(y_i, w_i)|, as NaturalResidual()
  double complementarity = 0;  // max |Σ_i y_i w_i|
  double size = 0;             // max of |y_i| and |w_i|
};

// Of `y` and `w`, of the same shape. The bits do not depend on the processor: sums always have sixteen lanes.
PairNorms MeasurePairs(const Eigen::Ref<const Matrix>& y, const Eigen::Ref<const Matrix>& w);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_PAIR_NORMS_H_
