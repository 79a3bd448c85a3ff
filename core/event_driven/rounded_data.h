// SPDX-License-Identifier: Apache-2.0
// A problem with differently rounded data: shows the effect of an ulp of the data on the solution.

#ifndef DLCS_CORE_EVENT_DRIVEN_ROUNDED_DATA_H_
#define DLCS_CORE_EVENT_DRIVEN_ROUNDED_DATA_H_

#include "core/problem/problem.h"

namespace dlcs {

// `problem` with every nonzero entry of A, B, N and x0, and each component of f and g as a whole, multiplied by 1 +
// ulps ε or 1 - ulps ε, with pseudo-random signs that depend on `seed`. A singular M would lose its class:
// unless `changes_M`, only its diagonal is raised by ulps ε of its size. Steps solve LCPs with the rounded sum of M and
// a multiple of N B, so this much is rounded also where M is exact. Kronecker sums are not changed.
//
// The solutions of both problems on the same grid differ by the effect of rounding, in the data and in the method. A
// comparison of different steps does not show that.
Problem WithRoundedData(const Problem& problem, double ulps, bool changes_M, unsigned seed = 0);

// x' = (1 + `ulps` ulps) (A x + B y + f). The effect of rounding, all of one sign so that none of it cancels: other
// than by separate ulps in every entry the constraints N x + g + M y of an ideal circuit keep their structure.
Problem WithFasterRates(const Problem& problem, double ulps);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_ROUNDED_DATA_H_
