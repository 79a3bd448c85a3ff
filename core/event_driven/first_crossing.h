// SPDX-License-Identifier: Apache-2.0
// Where a polynomial first falls below zero.

#ifndef DLCS_CORE_EVENT_DRIVEN_FIRST_CROSSING_H_
#define DLCS_CORE_EVENT_DRIVEN_FIRST_CROSSING_H_

#include <optional>

#include "core/discretization/legendre.h"

namespace dlcs {

// The first s in [-1, 1] behind which the polynomial Σ_k series[k] P_k + `shift` is negative; absent where it
// is nowhere. Negative at -1 already gives -1.
//
// Nothing is missed: a polynomial lies above the smallest of its Bernstein coefficients, so that a smooth interval
// without a negative one needs no search, and others are halved, the left half first. A polynomial that only
// touches zero (from above, to rounding) has no crossing. `before` cuts the search: only crossings before it
// are of interest. Accuracy: 1e-15 in s, where the root is simple. Cost: K² for most calls, some 50 K²/2 for
// a crossing.
std::optional<double> FirstCrossing(const LegendreVector& series, double shift, double before = 1);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_FIRST_CROSSING_H_
