// SPDX-License-Identifier: Apache-2.0
// What counts as zero in the equations of a circuit: parts of the terms that a number is the sum of
// (core/linalg/bounded_sum.h).

#ifndef DLCS_CORE_CIRCUITS_CIRCUIT_ROUNDING_H_
#define DLCS_CORE_CIRCUITS_CIRCUIT_ROUNDING_H_

namespace dlcs {

// The rounding of factors of the equations, and of voltages and currents that these give: they come from an
// elimination with pivots of the size of the other entries.
inline constexpr double kNetworkRounding = 1e-13;
// The rounding of w at the start, which states and sources give.
inline constexpr double kStartRounding = 1e-12;

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_CIRCUIT_ROUNDING_H_
