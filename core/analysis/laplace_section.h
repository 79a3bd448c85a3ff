// SPDX-License-Identifier: Apache-2.0
// What is known about the iteration by Laplace inversion before it is run.

#ifndef DLCS_CORE_ANALYSIS_LAPLACE_SECTION_H_
#define DLCS_CORE_ANALYSIS_LAPLACE_SECTION_H_

#include "core/analysis/findings.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"

namespace dlcs {

// The conditions and constants of [Wu & Chen] for `problem` with the contour, step and tolerance of `options`: whether
// the iterations apply; α, φ, Θ_1, Θ_max and L̃; the iterations of wu_chen_iteration over the whole horizon (2.7a); the
// error of its quadrature (2.8); for Z-matrices ρ, β, C_0 and T* of Theorem 3.2; κ, window and iterations per window of
// laplace_iteration.
//
// With more than kMaxLaplaceStates states, the section says only whether the iterations apply. Quadrature errors are
// given for up to kMaxQuadratureStates states.
// Cost: a complex Schur form, 16 (P + 1) resolvents, one set of φ-functions per step length: O(m³) each.
AnalysisSection LaplaceSection(const Problem& problem, const Options& options, const MatrixClass& matrix_class,
                               Selection selection);
inline constexpr Index kMaxLaplaceStates = 128;
inline constexpr Index kMaxQuadratureStates = 16;

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_LAPLACE_SECTION_H_
