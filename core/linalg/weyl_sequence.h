// SPDX-License-Identifier: Apache-2.0
// Numbers without a pattern that are the same in every run.

#ifndef DLCS_CORE_LINALG_WEYL_SEQUENCE_H_
#define DLCS_CORE_LINALG_WEYL_SEQUENCE_H_

#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/types.h"

namespace dlcs {

// The fractional part of k φ, where φ is the golden section. The values for k = 1, 2, ..., K spread evenly over (0, 1),
// whatever K is, and no multiple of a common step is among them: good as places to look at a function, and as weights
// of a sum whose terms must not cancel.
inline double WeylValue(double k) { return std::fmod(k * (std::numbers::phi - 1), 1.0); }

// `size` pseudo-random signs for rounding errors, different for each `seed`.
inline auto SignsOfRounding(Index size, unsigned seed = 0) {
  return Vector::NullaryExpr(size, [seed](Index i) -> double {
    // The mixing of splitmix64.
    std::uint64_t z =
        0x9E3779B97F4A7C15u * (static_cast<std::uint64_t>(i) + 1 + (static_cast<std::uint64_t>(seed) << 32));
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return (z >> 63) != 0 ? -1 : 1;
  });
}

// Rounding errors of rows: parts, between a half and one, of their bounds, with signs. By signs alone they may cancel
// to nothing: a state that is zero stays so if each row is off by an ulp of its terms, and a fast state may be the same
// multiple of the bounds in all rows.
inline Vector PartsOfRounding(Index size, unsigned seed = 0) {
  Vector parts = SignsOfRounding(size, seed);
  for (Index i = 0; i < size; ++i) parts[i] *= 0.5 + 0.5 * WeylValue(static_cast<double>(i) + 1 + seed);
  return parts;
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_WEYL_SEQUENCE_H_
