// SPDX-License-Identifier: Apache-2.0
// The basis of LCP(q, M) for a tridiagonal M-matrix, from nothing, in O(n).

#ifndef DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_GROWTH_H_
#define DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_GROWTH_H_

#include "core/lcp/basis/lcp_solver.h"
#include "core/lcp/structured/tridiagonal.h"

namespace dlcs {

// Chandrasekaran's method (core/lcp/dense/least_element.h): the basis S grows from the empty one by indices with
// w_j < 0, each of which belongs to the basis of the least element. S falls into runs of neighbors, and w_j
// needs no more of a run than y at the end that touches j. Of each run we keep y and the inverse of its block
// at its two ends; a new index joins the runs on its left and right in a dozen operations, and only the two
// indices beside the new run have to be looked at again. Every index enters once: O(n) in all, where policy
// iteration from a bad guess may take O(n) rounds. All sums are of numbers of one sign, so nothing cancels.
//
// `M` must be what IsClearlyMMatrix() asks for; `basis` (n entries) is overwritten, and right up to rounding;
// adds |S| to `pivots`. w_j counts as negative below `tolerance`_j and rounding, as in PolicyIteration.
//
// Source: the same bound is reached by another method in [Cryer 1983] C. W. Cryer. The efficient solution of
// linear
//         complementarity problems for tridiagonal Minkowski matrices. ACM Trans. Math. Software 9(2),
//         199-214.
void GrowLeastBasis(const Tridiagonal& M, const Eigen::Ref<const Vector>& q,
                    const Eigen::Ref<const Vector>& tolerance, Basis& basis, Index& pivots);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_GROWTH_H_
