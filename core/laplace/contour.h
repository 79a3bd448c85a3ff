// SPDX-License-Identifier: Apache-2.0
// Hyperbolic contours for the inversion of Laplace transforms, with their trapezoidal rules.

#ifndef DLCS_CORE_LAPLACE_CONTOUR_H_
#define DLCS_CORE_LAPLACE_CONTOUR_H_

#include <complex>
#include <vector>

#include "core/types.h"

namespace dlcs {

// z(v) = (μ/t)(1 + sin(iv - γ)) at v_p = p Δv, p = -P..P: (2.2) of [Wu & Chen], with the factor 1/t that is missing in
// print. It opens to the left with asymptotes at the angle π/2 - γ from the negative real axis and crosses the real
// axis at (μ/t)(1 - sin γ) > 0.
struct Contour {
  Index nodes = 0;  // P
  double mu = 0;
  double gamma = 0;
  double step = 0;  // Δv
};

// The parameters of Theorem 2.2 of [Wu & Chen]: γ = 0.794, μ = √P/4, Δv = 2.06/√P; error O(e^{-2.06√P}/√P) for the
// source term of a sectorial A.
Contour SourceContour(Index nodes);

// Remark 2.3 of [Wu & Chen] for e^{At} x0: μ = 4.4921 P, γ = 1.1721, Δv = 1.0818/P; error O(e^{-2.32 P}), until
// rounding grows like e^{0.35 P} 1e-16: best at P = 13 with some 1e-14.
// Source: [Weideman & Trefethen 2007] Parabolic and hyperbolic contours for computing the Bromwich integral.
// Math. Comp. 76, 1341-1356.
Contour InitialStateContour(Index nodes);

// A node at t = 1; at time t both numbers are divided by t. There are nodes for p = 0..P only: for real data the terms
// of p and -p are conjugates, so the sum over all nodes is the real part of Σ_p weight · (...), with weight = Δv/(2πi)
// z'(v_p), doubled for p > 0.
struct ContourNode {
  std::complex<double> z;
  std::complex<double> weight;
  double log_derivative = 0;  // |z'/z|
};
std::vector<ContourNode> Nodes(const Contour& contour);

// Σ_{p=-P..P} |z'_p/z_p| · l ∫_0^1 (1-τ)^{l-1} e^{μτ(1 - sinγ cosh v_p)} dτ: Θ_l of (2.7b), l >= 1.
double Theta(const Contour& contour, int l);

// Θ_max = (2P + 1) e^{μ(1 - sin γ)} √((1 + sin γ)/(1 - sin γ)) >= Θ_l for all l, (2.15).
double ThetaMax(const Contour& contour);

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_CONTOUR_H_
