// SPDX-License-Identifier: Apache-2.0
// The rounding in q = N x + g, and what counts as zero because of it.

#ifndef DLCS_CORE_LCP_BASIS_TOLERANCE_H_
#define DLCS_CORE_LCP_BASIS_TOLERANCE_H_

#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

// For each row the size of the terms that q = N x + g is the sum of, the maximum over the columns: the rounding in q_i
// is 1e-16 times this size, and w_i smaller than kLcpTolerance times it counts as zero. Each row has its own size,
// since rows may have different units (volts and amperes).
Vector SizeOfSums(const StructuredMatrix& N, const Eigen::Ref<const Matrix>& x, const Eigen::Ref<const Matrix>& g);
constexpr double kLcpTolerance = 1e-13;

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BASIS_TOLERANCE_H_
