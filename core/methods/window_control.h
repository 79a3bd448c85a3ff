// SPDX-License-Identifier: Apache-2.0
// When the iteration on a window has converged or diverged, and how wide the next window is to be.

#ifndef DLCS_CORE_METHODS_WINDOW_CONTROL_H_
#define DLCS_CORE_METHODS_WINDOW_CONTROL_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// The longest window that is chosen without being asked for, and the first when nothing is known of the contraction.
inline constexpr Index kLongestWindow = 2048;
inline constexpr Index kFirstWindow = 16;

// The largest change of a row in units of its size. Rows that vanish but for rounding are measured against the largest
// one.
double RelativeChange(const Vector& size, const Vector& change);

// Stops when the change, which is what y still owes its LCP, and the error that is left, which for a contraction
// by ρ is change ρ/(1 - ρ), are both small. Changes at the level of rounding cannot contract any more.
bool Converged(const std::vector<double>& changes, double tolerance);

// Whether the changes grew too far to be worth waiting, or are no smaller than some iterations ago.
bool Diverging(const std::vector<double>& changes);

// The width after an accepted window of `steps` steps that took so many `iterations`.
Index NextWidth(Index width, Index steps, Index iterations);

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_WINDOW_CONTROL_H_
