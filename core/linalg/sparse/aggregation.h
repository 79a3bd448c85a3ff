// SPDX-License-Identifier: Apache-2.0
// Coarse unknowns for multigrid: groups of strongly coupled ones.

#ifndef DLCS_CORE_LINALG_SPARSE_AGGREGATION_H_
#define DLCS_CORE_LINALG_SPARSE_AGGREGATION_H_

#include "core/linalg/sparse/compressed_rows.h"

namespace dlcs {

// Unknown i is coupled strongly to j if a_ij² > threshold² |a_ii a_jj|; `without_skew` only if a_ij < 0 and a_ji <= 0,
// not as a state and what controls it. The unknowns are divided into groups of strong neighbors, and the returned P,
// one row for each unknown and one column for each group, takes values of groups to unknowns: first the value of the
// own group, then a weighted mean with the strong neighbors. Rows add up to 1, so constants stay constants, which
// errors that smoothing leaves behind resemble. The row of an unknown without strong neighbors is empty: smoothing
// alone treats it.
//
// `A` is square, its pattern symmetric. Cost: some passes over A, on one thread. Looks for stop requests.
// Source: [Vaněk, Mandel, Brezina 1996] Algebraic multigrid by smoothed aggregation for second and fourth order
// elliptic problems. Computing 56, 179-196. (Their filtered matrix keeps the sums of rows; ours has sums zero.)
CompressedRows<float> SmoothedAggregation(const CompressedRows<float>& A, double threshold, bool without_skew);

// Pᵀ.
CompressedRows<float> Transposed(const CompressedRows<float>& P);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SPARSE_AGGREGATION_H_
