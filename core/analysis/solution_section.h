// SPDX-License-Identifier: Apache-2.0
// Which solution of LCP(N x + g, M) is meant, how steep it is as a function of q, and what it looks like at t = 0.

#ifndef DLCS_CORE_ANALYSIS_SOLUTION_SECTION_H_
#define DLCS_CORE_ANALYSIS_SOLUTION_SECTION_H_

#include <stop_token>

#include "core/analysis/findings.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/problem.h"

namespace dlcs {

// The section "solution" of the analysis of a valid `problem`, for its matrix class and the selection: constants
// lipschitz (𝓛 = L), cube-bound (2.6) for P-matrices, mangasarian-shiau (2.14), basic-solutions, slope; findings
// nondegenerate; at t = 0, q = N x0 + g(0): solvable, unique, degenerate, differentiable, interior-point.
//               Witnesses hold y, index sets, or the interior point;
// warnings      several solutions at the start and no rule to choose, ties, a selection that may jump.
// Cost: that of Classify(), one LCP, one linear program, and for n <= 12 the 2ⁿ bases.
// `stop` is checked for every basis.
AnalysisSection SolutionSection(const Problem& problem, const MatrixClass& matrix_class, Selection selection,
                                const std::stop_token& stop = {});

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_SOLUTION_SECTION_H_
