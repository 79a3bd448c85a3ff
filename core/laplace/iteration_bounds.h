// SPDX-License-Identifier: Apache-2.0
// The convergence bounds of the iteration by Laplace inversion, as numbers.

#ifndef DLCS_CORE_LAPLACE_ITERATION_BOUNDS_H_
#define DLCS_CORE_LAPLACE_ITERATION_BOUNDS_H_

#include <optional>
#include <stop_token>
#include <vector>

#include "core/laplace/contour.h"
#include "core/laplace/resolvent.h"
#include "core/problem/problem.h"

namespace dlcs {

// φ of (2.1b), measured: sup |z| ‖(zI - A)⁻¹‖_∞ over the nodes z_p/t of the contour for all t in `times` (each > 0). It
// varies slowly with t and tends to 1 for t -> 0. NaN if `stop` was requested (checked before every node). Cost: O(P
// m³) for each time.
double ResolventFactor(const Contour& contour, const Resolvent& resolvent, const std::vector<double>& times,
                       const std::stop_token& stop = {});

// L̃ = Δv φ L ‖B‖‖N‖/(2π) of (2.13) in the ∞-norm, with L = `lipschitz`.
double IterationRate(const Contour& contour, double resolvent_factor, double lipschitz, const Problem& problem);

// (2.7a) of [Wu & Chen] in logarithms:  ‖x^k - x*‖ <= F_k ‖x^0 - x*‖  and  ‖x^{k+1} - x^k‖ <= F_k ‖x^1 - x^0‖  with
// F_k = (L̃T)^k Θ_1⋯Θ_k / k!, which grows while k < L̃ T Θ and then falls faster than any geometric sequence.
class IterationBound {
 public:
  // `rate` is L̃ >= 0, `horizon` T > 0.
  IterationBound(const Contour& contour, double rate, double horizon);

  // log F_k, k >= 0; -inf where L̃ = 0 and k > 0. O(P) for each new k.
  double LogFactor(int k);

  // The smallest k with F_k <= `tolerance` (in (0, 1]): iterations that are enough from any start. Beyond
  // kMaxExactFactors it is counted with Θ_max in place of Θ_l, which gives no fewer. Absent for an infinite rate.
  std::optional<double> IterationsFor(double tolerance);
  static constexpr int kMaxExactFactors = 500;

  // log Σ_r F_r, (2.14a): the factor by which an error that is made in every iteration (that of the quadrature) can
  // grow.
  double LogAmplification();

 private:
  Contour contour_;
  double log_rate_;  // of L̃ T
  std::vector<double> log_factors_;
};

// The same for the iteration in reduced space on a window of W steps: the discrete kernel moves q by at most κ h y in a
// step, so with r = L κ h the factor is r^k C(W + k - 1, k), which tends to (L κ t)^k/k!.
double LogReducedFactor(double rate, double window, int k);

// The window W with r W <= 1 (at least a step, at most `most`), on which the reduced iteration contracts at once.
double RecommendedWindow(double rate, double most);

// The smallest k for which LogReducedFactor() is below log `tolerance`; absent for r >= 1, where one step may diverge.
std::optional<double> ReducedIterationsFor(double rate, double window, double tolerance);

// max over `times` of  t ∫_0^1 ‖Q_t(σ) - e^{tσA}‖_∞ dσ,  where Q_t(σ) = Σ_p weight_p e^{z_p σ} (z_p I - tA)⁻¹ stands
// for e^{tσA} in (2.5): a source of size 1 then errs by no more at those times, the Err_max of (2.12) as a number.
// The integral is summed at points even in log σ. Cost: O(m³ + P m²) for each of 128 points and each time.
double SourceQuadratureError(const Contour& contour, const Resolvent& resolvent, const Matrix& A,
                             const std::vector<double>& times);

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_ITERATION_BOUNDS_H_
