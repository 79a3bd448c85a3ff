// SPDX-License-Identifier: Apache-2.0
// The contour for a sector and a set of options.

#ifndef DLCS_CORE_LAPLACE_CONTOUR_CHOICE_H_
#define DLCS_CORE_LAPLACE_CONTOUR_CHOICE_H_

#include "core/laplace/contour.h"
#include "core/problem/options.h"

namespace dlcs {

// Remark 2.4 of [Wu & Chen]: γ, μ and Δv = h that minimize the error of the source term at P = `nodes`, for an A with
// its spectrum in |arg(-λ)| <= `sector_angle` (below π/2). Minimizes over μ <= 4 the largest of three parts of the
// error, in logarithms:
//
//     -2π (π/2 - α - γ)/h        the contour may be moved by this much before it meets the sector,
//     μ - 2πγ/h                  and by γ to the other side, where it is a vertical line through μ,
//     log(2/(μ sin γ)) - hP      what is cut off: ∫ |z'/z²| beyond the last node; near τ = t nothing decays faster.
//
// For large P this is δ√P with δ -> √(π(π/2 - α)), h = δ/√P, γ -> (π/2 - α)/2: 2.22 for α = 0 (the paper's 2.06 has a
// larger μ), 1.08 for α = 1.2, 0.47 for α = 1.5.
Contour BestSourceContour(Index nodes, double sector_angle);
// The largest of the three for any contour: the logarithm of the error, up to a factor of moderate size.
double LogSourceError(const Contour& contour, double sector_angle);

// The source of the parameters of ContourFor(): "Theorem 2.2", "Remark 2.4" or "given".
const char* ContourSource(const Options& options, double sector_angle);

// The contour of wu_chen_iteration according to options.contour. With kAuto: the parameters of Theorem 2.2 if
// `sector_angle` + γ < π/2, else those of Remark 2.4 (up to kWidestSector; wider sectors would need P in the hundreds).
// Parameters set in `options` replace them.
Contour ContourFor(const Options& options, double sector_angle);
inline constexpr double kWidestSector = 1.2;

// The widest sector that this contour encloses; eigenvalues outside it must be split off.
double WidestSector(const Options& options);

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_CONTOUR_CHOICE_H_
