// SPDX-License-Identifier: Apache-2.0
// American put options on one or two assets.

#ifndef DLCS_CORE_MODELS_AMERICAN_OPTION_H_
#define DLCS_CORE_MODELS_AMERICAN_OPTION_H_

#include "absl/status/statusor.h"
#include "core/problem/problem.h"

namespace dlcs {

// The equation of Black, Scholes and Merton in z_i = ln(S_i / K), t the time to maturity and v the value over the
// strike K:
//     v_t = Σ σ²/2 v_ii + ρ σ² v_12 + Σ (r - σ²/2) v_i - r v + y,   0 <= y ⟂ v - payoff >= 0,   v(0) = payoff,
// payoff = max(0, 1 - mean of e^{z_i}), on |z_i| <= max(1, 5σ√T), where v = payoff on the boundary.
struct AmericanOptionModel {
  Index cells = 100;        // of the grid in each direction, even so that z = 0 is a point
  Index dimensions = 1;     // assets, 1 or 2
  double rate = 0.05;       // r >= 0
  double volatility = 0.2;  // σ > 0, of each asset
  double correlation = 0;   // ρ from -1 to 1, of two assets
  double horizon = 1;       // the maturity
};

// Centered differences at the Q^d inner points, Q = cells - 1; v_12 by the seven points that leave A with nonnegative
// entries off its diagonal where the drift is small. A is sparse and not symmetric, B = N = I, M = 0, g = -payoff, and
// f holds the boundary. The last asset runs slowest. Errors: InvalidArgument, one line per broken rule.
absl::StatusOr<Problem> MakeAmericanOptionProblem(const AmericanOptionModel& model);

}  // namespace dlcs

#endif  // DLCS_CORE_MODELS_AMERICAN_OPTION_H_
