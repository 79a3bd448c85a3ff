// SPDX-License-Identifier: Apache-2.0
// One hyperbola for the inversion of a Laplace transform over a whole range of times.

#ifndef DLCS_CORE_LAPLACE_RANGE_CONTOUR_H_
#define DLCS_CORE_LAPLACE_RANGE_CONTOUR_H_

#include <optional>
#include <vector>

#include "core/laplace/contour.h"
#include "core/types.h"

namespace dlcs {

// z(v) = σ + (μ/t_b)(1 + sin(iv - γ)) for all t in [t_a, t_b]: the hyperbola of core/laplace/contour.h, moved by σ
// so that what it encloses lies in the sector |arg(σ - λ)| <= α.
struct RangeContour {
  double begin = 0;   // t_a
  double end = 0;     // t_b
  double shift = 0;   // σ >= 0
  Contour hyperbola;  // at t_b
  // Rounding in the sum is e^{log_loss} times that of one term, relative to e^{t max(0, Re λ)}.
  double log_loss = 0;

  // z and weight = Δv/(2πi) z'(v), doubled for p > 0: f(t) = Re Σ_p weight_p e^{z_p t} F(z_p) for real f.
  std::vector<ContourNode> Nodes() const;
};

// The contour from `begin` on with the fewest nodes per octave of time for these `eigenvalues`, with an error of about
// e^{-`accuracy`}. It ends at 16, 8, 4 or 2 times `begin`, not before `least_end`. It encloses zero. It satisfies five
// conditions, with T = t_b, E = `accuracy`, and δ = π/2 - α - γ:
//
//     2πδ/Δv >= E + μ(1 - cos α)      the contour may be moved by δ before it meets the sector,
//     2πγ/Δv >= E + μ                 and by γ to the other side, where it is a vertical line,
//     (t_a/T) μ (sin γ cosh(P Δv) - 1) >= E      what is cut off has decayed at the shortest time,
//     μ(1 - sin γ) + (σ - max(0, Re λ)) T <= 7   no term is so large that rounding spoils 1e-12,
//     σ >= Re λ + |Im λ|/tan α        for each eigenvalue but those with e^{t_a Re λ} < e^{-45}, which have died out.
//
// σ and α are a trade-off: an eigenvalue with a large imaginary part relative to its decay costs nodes or rounding. The
// result is empty if no choice of them stays within 7, as for an imaginary λ with |λ| t_a in the tens.
// Source: [Weideman & Trefethen 2007] (core/laplace/contour.h); the shift is ours.
std::optional<RangeContour> FindRangeContour(double begin, double least_end, double accuracy,
                                             const Eigen::VectorXcd& eigenvalues);

// The same from `begin` to `end`, for a spectrum, or a field of values, in the sector |arg(σ - λ)| <= `angle`, σ =
// `shift` >= 0.
std::optional<RangeContour> FindSectorContour(double begin, double end, double accuracy, double angle, double shift);

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_RANGE_CONTOUR_H_
