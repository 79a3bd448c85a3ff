// SPDX-License-Identifier: Apache-2.0
// A problem whose numbers are rounded otherwise: what an ulp of the data is worth.

#ifndef DLCS_CORE_EVENT_DRIVEN_ROUNDED_DATA_H_
#define DLCS_CORE_EVENT_DRIVEN_ROUNDED_DATA_H_

#include "core/problem/problem.h"

namespace dlcs {

// `problem` with every nonzero entry of A, B, N and x0, and each component of f and g as a whole, multiplied by 1 +
// ulps ε or 1 - ulps ε, by signs without a pattern; those of M too where `changes_M`, which a singular M does not
// stand. `seed` gives other signs. Kronecker sums stay as they are.
//
// Two solves on the same grid, of the problem and of this one, differ by what the data do not determine and what
// rounding makes of it in the method: no comparison of steps shows that.
Problem WithRoundedData(const Problem& problem, double ulps, bool changes_M, unsigned seed = 0);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_ROUNDED_DATA_H_
