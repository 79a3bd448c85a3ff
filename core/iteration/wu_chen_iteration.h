// SPDX-License-Identifier: Apache-2.0
// The iteration of Wu & Chen exactly as printed.

#ifndef DLCS_CORE_ITERATION_WU_CHEN_ITERATION_H_
#define DLCS_CORE_ITERATION_WU_CHEN_ITERATION_H_

#include "core/context/solve_context.h"

namespace dlcs {

// Solves the problem of `context` by (2.17) (P-matrices) and (3.3) (Z-matrices) of [Wu & Chen], on the whole of
// [0, T] at once and from x^0 = x0:
//
//     y_j^{k+1} = SOL(N x_j^k + g_j, M),
//     x_j^{k+1} = e^{A t_j} x0 + Δv/(2πi) Σ_{p=-P..P} z'_p (z_p I - A)⁻¹ ∫_0^{t_j} e^{z_p (t_j - τ)} (Bỹ^{k+1} + f̃) dτ
//
// with ỹ, f̃ piecewise linear, or cubic splines by options.interpolation (Remark 2.5), and the nodes z_p = z(v_p) of
// the contour (2.2), a different contour for each t_j. Parallel over times and contour nodes; same bits for any
// number of threads.
//
// Requires a Lipschitz y (or one that stays so, Remark 3.1). The contour is that of options.contour; with kAuto that of
// Theorem 2.2, or, for sectors too wide for it, that of Remark 2.4 up to kWidestSector, with a warning. Eigenvalues
// outside the sector |arg(-λ)| < π/2 - γ, imaginary and unstable ones, are split off and integrated by φ-functions
// (core/laplace/spectrum_split.h; zero lies inside every contour), with a warning. Solution::contour holds the details.
// If the iterations run out, the trajectory is the last iterate, with its certificate.
// Cost: O(J² P m) an iteration. This is the printed method, meant for checking; LaplaceIteration() is the fast form.
// Accuracy: that of the contour, O(e^{-2.06√P}/√P) for narrow sectors (core/laplace/contour_choice.h), besides the
// interpolation: O(h²), with cubic splines O(h⁴) where f and y are smooth. The certificate measures x and y as
// interpolated linearly.
bool WuChenIteration(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_WU_CHEN_ITERATION_H_
