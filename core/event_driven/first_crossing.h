// SPDX-License-Identifier: Apache-2.0
// Where a polynomial first falls below zero.

#ifndef DLCS_CORE_EVENT_DRIVEN_FIRST_CROSSING_H_
#define DLCS_CORE_EVENT_DRIVEN_FIRST_CROSSING_H_

#include <optional>

#include "core/discretization/legendre.h"

namespace dlcs {

// The first s in [-1, 1] after which the polynomial Σ_k series[k] P_k + `shift` is negative; absent if it is not
// negative anywhere. If it is negative at -1, the result is -1.
//
// No crossing is missed: a polynomial lies above the smallest of its Bernstein coefficients, so an interval without a
// negative coefficient needs no search; others are bisected, left half first. A polynomial that only touches zero (from
// above, to rounding) has no crossing. Only crossings before `before` are searched for. Accuracy: 1e-15 in s, where the
// root is simple. Cost: K² for most calls, some 50 K²/2 for a crossing.
std::optional<double> FirstCrossing(const LegendreVector& series, double shift, double before = 1);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_FIRST_CROSSING_H_
