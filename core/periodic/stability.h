// SPDX-License-Identifier: Apache-2.0
// Whether disturbances of a periodic solution die out.

#ifndef DLCS_CORE_PERIODIC_STABILITY_H_
#define DLCS_CORE_PERIODIC_STABILITY_H_

#include <limits>

#include "core/periodic/period_map.h"
#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// dx(P)/dx(0), and bounds of the errors of its entries.
struct KnownDerivative {
  Matrix value;
  Matrix errors;
};

// In the units `unit` of the states. Of an oscillation, for which the period is no matter of the sources, the
// disturbance along the solution, with its multiplier 1, is mapped to 0 instead, and the other multipliers stay; errors
// are by how far x'(0) is from being repeated. Otherwise they are 0.
KnownDerivative DerivativeAcross(const PeriodSolve& solve, const Vector& unit, bool is_oscillation);

struct StabilityJudgement {
  Stability stability = Stability::kUndetermined;
  double growth = std::numeric_limits<double>::quiet_NaN();  // PeriodicRecord::growth
};

// Judges by the multipliers, the eigenvalues of the derivative.
//
// A multiplier λ is known to be outside or inside of the unit circle if no matrix within the errors has one at z, the
// point of the circle next to λ: by Neumann's series if |(z I - value)⁻¹| · errors has a norm below 1. For a
// simple λ that is its distance from the circle against the errors times its condition number. It holds for multiple
// ones too: a state that is set anew in every period makes a multiplier 0, and several of them one without eigenvectors
// of its own. If another multiplier is near z, one outside is still known to be there if none is at z √|λ|.
//
// Unstable: one of them is known to be outside. Stable: all are known to be inside. Cost: m inverses.
StabilityJudgement JudgeStability(const KnownDerivative& derivative);

}  // namespace dlcs

#endif  // DLCS_CORE_PERIODIC_STABILITY_H_
