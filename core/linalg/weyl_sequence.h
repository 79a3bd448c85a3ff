// SPDX-License-Identifier: Apache-2.0
// Numbers without a pattern that are the same in every run.

#ifndef DLCS_CORE_LINALG_WEYL_SEQUENCE_H_
#define DLCS_CORE_LINALG_WEYL_SEQUENCE_H_

#include <cmath>

namespace dlcs {

// The fractional part of k φ, where φ is the golden section. The values for k = 1, 2, ..., K spread evenly over (0, 1),
// whatever K is, and no multiple of a common step is among them: good as places to look at a function, and as weights
// of a sum whose terms must not cancel.
inline double WeylValue(double k) {
  constexpr double kGoldenSection = 0.6180339887498949;
  return std::fmod(k * kGoldenSection, 1.0);
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_WEYL_SEQUENCE_H_
