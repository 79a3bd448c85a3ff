// SPDX-License-Identifier: Apache-2.0
// A problem with differently rounded data: shows the effect of an ulp of the data on the solution.

#ifndef DLCS_CORE_EVENT_DRIVEN_ROUNDED_DATA_H_
#define DLCS_CORE_EVENT_DRIVEN_ROUNDED_DATA_H_

#include "core/problem/problem.h"

namespace dlcs {

// `problem` with every nonzero entry of A, B, N and x0, and each component of f and g as a whole, multiplied by 1 +
// ulps ε or 1 - ulps ε, with pseudo-random signs that depend on `seed`. Entries of M are changed only with `changes_M`,
// since a singular M would lose its class. Kronecker sums are not changed.
//
// The solutions of both problems on the same grid differ by the effect of rounding, in the data and in the method. A
// comparison of different steps does not show that.
Problem WithRoundedData(const Problem& problem, double ulps, bool changes_M, unsigned seed = 0);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_ROUNDED_DATA_H_
