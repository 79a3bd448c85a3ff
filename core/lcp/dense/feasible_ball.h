// SPDX-License-Identifier: Apache-2.0
// How far q may move before LCP(q, M) stops being feasible.

#ifndef DLCS_CORE_LCP_DENSE_FEASIBLE_BALL_H_
#define DLCS_CORE_LCP_DENSE_FEASIBLE_BALL_H_

#include <optional>

#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

// The largest ρ such that FEA(q, M) is not empty for every q with ‖q - q0‖_∞ <= ρ.
struct FeasibleBall {
  // ρ; infinite where M is an S-matrix (some z >= 0 has M z > 0: every q is feasible), negative where q0 itself is not
  // feasible (then -ρ is what must be added to every component). Absent where the linear program failed.
  std::optional<double> radius;
  // The witness: y >= 0 with q0 + M y >= ρ e; for an infinite radius y >= 0 with M y > 0.
  Vector y;
};

// Solves  max ρ  subject to  q0 - ρ e + M y >= 0, y >= 0:  ρ of γ in (4.2) of [Chen & Xiang 2013] and of β in (3.5) of
// [Wu & Chen]. The worst q of a ball is q0 - ρ e, since FEA grows with q. The radius that is returned is
// min_i (q0 + M y)_i, so the witness proves it by arithmetic: it is never too large by more than rounding.
//
// `q0` has n entries, `M` is n × n, both finite. Cost: two linear programs of n rows and n + 1 variables. Thread-safe.
FeasibleBall LargestFeasibleBall(const Vector& q0, const Matrix& M);

// β of (3.5): ‖x - x0‖_∞ < β keeps FEA(N x + g(t), M) not empty for q0 = N x0 + g(0), as long as ‖g(t) - g(0)‖_∞ <=
// `drift`. β = (ρ - drift)/‖N‖_∞; infinite where ρ is, or where N = 0 and ρ >= drift; 0 where the drift alone leaves
// the ball.
double FeasibleStateRadius(double radius, double drift, const StructuredMatrix& N);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_FEASIBLE_BALL_H_
