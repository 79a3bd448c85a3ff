// SPDX-License-Identifier: Apache-2.0
// Bounds for the step length of Newton's method, and for the interval on which a solution is guaranteed.

#ifndef DLCS_CORE_STEPPING_NEWTON_BOUNDS_H_
#define DLCS_CORE_STEPPING_NEWTON_BOUNDS_H_

#include <optional>

#include "absl/status/statusor.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/problem.h"

namespace dlcs {

// All of this is of [Chen & Xiang 2013], sections 3 and 4, in the norm ‖·‖_∞. It needs y to be a Lipschitz
// function of x: a `choice` with IsAlwaysLipschitz().

// κ = ‖A‖ + 𝓛‖B‖‖N‖: the right-hand side A x + B y(N x + g) + f is Lipschitz in x with constant κ, if y is Lipschitz
// with the constant `lipschitz`; absent if that is absent.
//
// With a step h < 1/κ, H of (3.1) is a contraction with the rate hκ (Lemma 3.1). With 3hκ < 1 Newton's method
// converges (Theorem 3.2): with x⁺ the solution of the step,
//
//     ‖u^{k+1} - x⁺‖ <= 2hκ/(1 - hκ) ‖u^k - x⁺‖,
//
// since V_k(u^k - x⁺) - F(u^k) = hB(y(u^k) - y(x⁺) + Y_k N(u^k - x⁺)) with ‖Y_k‖ <= 𝓛, and ‖V_k⁻¹‖ <= 1/(1 -
// hκ), (3.5). (The printed proof applies Banach's theorem to a map that need not be continuous; this takes
// its place.)
std::optional<double> RightHandSideLipschitz(const Problem& problem, const std::optional<double>& lipschitz);

// The first step of the θ-scheme (1.3), of length h from x0, for any θ in [0, 1].
struct FirstStep {
  double step = 0;                // h
  double speed = 0;               // c = ‖A x0 + B y + f(h)‖ with y the solution of LCP(N x0 + g(h), M)
  std::optional<double> gamma;    // h c/(1 - hκ), where hκ < 1: the ball around x0 that holds x⁺ (Lemma 3.1)
  std::optional<double> gamma_1;  // h c/(1 - 3hκ), where 3hκ < 1: the ball that holds all u^k (Theorem 3.2)
  // How far x may move from x0 with LCP(N x + g(h), M) still solvable. The lemma and the theorem assume that
  // γ and γ_1 do not exceed it. Infinite for P-matrices; absent where the linear program failed.
  std::optional<double> room;

  bool newton_is_sure() const { return gamma_1 && room && *gamma_1 <= *room; }
};

// Absent where LCP(N x0 + g(h), M) has no solution. `step` in (0, T].
// Errors: InvalidArgument as TimeFunctionEvaluator. Cost: one LCP and two linear programs of n rows.
absl::StatusOr<std::optional<FirstStep>> BoundFirstStep(const Problem& problem, const SolutionChoice& choice,
                                                        double kappa, double step);

// Theorem 4.1. For all z in the ball of radius `gamma` around x0 and t in [0, `horizon`] LCP(N z + g(t), M)
// is solvable, (4.2), and so the system has one solution on [0, `interval`], and it stays in that ball:
//
//     T_0 = min{T, γ/(c_0 + κγ)},     c_0 = max over [0, T] of ‖A x0 + B y(N x0 + g(t)) + f(t)‖,
//     γ = (ρ - max over [0, T] of ‖g(t) - g(0)‖)/‖N‖     with ρ of core/lcp/dense/feasible_ball.h,
//
// with the T that makes T_0 largest. The paper has constant f in c_0; its proof needs the maximum.
struct GuaranteedInterval {
  double interval = 0;  // T_0
  double horizon = 0;   // T
  double gamma = 0;     // infinite where every q is feasible
  double speed = 0;     // c_0
  // Whether f or g is not constant: then the maxima are over 257 times and both sides of the break points.
  bool sampled = false;
};

// Absent where no γ > 0 exists: (4.1) does not hold, or a linear program or LCP at t = 0 failed.
// Errors: as above. Cost: two linear programs and 257 LCPs.
absl::StatusOr<std::optional<GuaranteedInterval>> GuaranteeInterval(const Problem& problem,
                                                                    const SolutionChoice& choice, double kappa);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_NEWTON_BOUNDS_H_
