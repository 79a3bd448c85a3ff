// SPDX-License-Identifier: Apache-2.0
// Dense output: a solution at any time.

#ifndef DLCS_CORE_EVENT_DRIVEN_INTERPOLANT_H_
#define DLCS_CORE_EVENT_DRIVEN_INTERPOLANT_H_

#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "core/problem/time_function.h"

namespace dlcs {

// Evaluates a solution between its nodes by the interpolant of its method (Solution::dense_output):
//
//     time_stepping            x linear, y_j on (t_{j-1}, t_j]: the interpolants of Theorem 7 in [Shen & Pang 2007];
//                              with average_y both linear
//     exponential_integrator,  x = e^{τA} x_{j-1} + τ(φ_1 - φ_2)(τA) s(t_{j-1}) + τ φ_2(τA) s(t), τ = t - t_{j-1},
//     laplace_iteration        s = B y + f, f linear between nodes, and y linear (exp-PL) or y_j (exp-PC)
//     wu_chen_iteration        as laplace_iteration; its nodes differ from that by the error of the contour
//     event_driven             the polynomials of its steps (Options::keep_pieces), as accurate as the nodes
//
// and w = N x + g + M y of these x and y; for event_driven, w has its own polynomials.
// Keeps references to problem and solution. Not safe to share between threads, as TimeFunctionEvaluator.
class Interpolant {
 public:
  // Errors: InvalidArgument if the solution has no interpolant (output times only, splines, nothing solved) or if its
  // shape is not that of the problem.
  static absl::StatusOr<Interpolant> Create(const Problem& problem, const Solution& solution);

  struct Point {
    Vector x, y, w;
  };

  // The limits at `time` from `side`, which differ where the state jumps, at nodes where y is constant on steps, and at
  // break points. At 0 and at the end of the solution both are the limit from inside. Times outside are moved there.
  // Cost: a binary search; and one set of φ-functions of A, unless x is linear (one product with B) or a polynomial.
  Point Limit(double time, Side side);

  // The values of the solution: at nodes the stored ones, between nodes those of the interpolant.
  Point At(double time);

 private:
  Interpolant(const Problem& problem, const Solution& solution, TimeFunctionEvaluator f, TimeFunctionEvaluator g);

  // x and y at t_{k} + tau, 0 <= tau <= the step, inside the step from node k to k + 1.
  Point InStep(Index k, double tau);
  Point InPiece(double time, Side side) const;
  Vector LeftState(Index k) const;  // x(t_k⁻)
  Vector LeftY(Index k) const;      // y(t_k⁻)

  const Problem& problem_;
  const Solution& solution_;
  TimeFunctionEvaluator f_, g_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_INTERPOLANT_H_
