// SPDX-License-Identifier: Apache-2.0
// A membrane, or a string, above an obstacle.

#ifndef DLCS_CORE_MODELS_OBSTACLE_H_
#define DLCS_CORE_MODELS_OBSTACLE_H_

#include <string>

#include "absl/status/statusor.h"
#include "core/problem/problem.h"

namespace dlcs {

// The parabolic obstacle problem on the unit interval or square:
//     u_t = c Δu + load(t) + y,   0 <= y ⟂ u - ψ >= 0 inside,   u = 0 on the boundary,   u(0) = max(ψ, 0),
// with the bump ψ(s) = 1/2 - 4 Σ (s_i - 1/2)². With one dimension and no load the string is at last in contact for
// |s - 1/2| <= (1 - √½)/2 and straight elsewhere.
struct ObstacleModel {
  Index cells = 16;        // 1/Δs >= 2
  Index dimensions = 1;    // 1 or 2
  double coefficient = 1;  // c > 0
  double horizon = 1;      // T
  std::string load = "0";  // a formula in t
};

// Centered differences at the Q^d inner points, Q = cells - 1: A is c/Δs² times a Kronecker sum of tridiag(1, -2, 1),
// B = N = I, M = 0, g = -ψ. Errors: InvalidArgument, one line per broken rule.
absl::StatusOr<Problem> MakeObstacleProblem(const ObstacleModel& model);

}  // namespace dlcs

#endif  // DLCS_CORE_MODELS_OBSTACLE_H_
