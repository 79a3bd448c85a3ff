// SPDX-License-Identifier: Apache-2.0
// Classes of small integer matrices by definition, found by rays and points in integers.

#ifndef DLCS_TESTS_HOSTILE_EXACT_CLASSES_TRUTH_H_
#define DLCS_TESTS_HOSTILE_EXACT_CLASSES_TRUTH_H_

#include "tests/support/integer_matrices.h"

namespace dlcs::testing {

// Some z >= 0 has M z > 0: the sum of the extreme rays of { z >= 0, M z >= 0 } does, or none. n <= 5.
bool IsExactlyS(const IntegerMatrix& M);

// LCP(0, M) has no ray of solutions. n <= 5.
bool IsExactlyR0(const IntegerMatrix& M);

// LCP(q, M) is solvable for all q, or for all that are feasible. The planes of the facets of all full complementary
// cones cut the space into cells, in each of which all points are solvable or none; a point inside of each cell is
// tried: the sum of n independent rays that planes meet in. n <= 3.
struct QTruth {
  bool q = true, q0 = true;
};
QTruth ExactlyQAndQ0(const IntegerMatrix& M);

// (4.10) of [Chen & Xiang]: column j of X is, without loss, an extreme ray of { x : x_i <= 0, (M x)_i <= 0, i != j }
// with x_j >= 0 or x_j <= 0, and all choices of such columns are tried: some (r, s) >= 0 has rᵀX + sᵀM X > 0 exactly
// where no combination λ >= 0, λ != 0, of the columns has Xλ <= 0 and M Xλ <= 0. n <= 3.
bool IsExactlyHiddenZ(const IntegerMatrix& M);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_HOSTILE_EXACT_CLASSES_TRUTH_H_
