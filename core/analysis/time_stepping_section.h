// SPDX-License-Identifier: Apache-2.0
// What is known about time stepping before it is run.

#ifndef DLCS_CORE_ANALYSIS_TIME_STEPPING_SECTION_H_
#define DLCS_CORE_ANALYSIS_TIME_STEPPING_SECTION_H_

#include "core/analysis/findings.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"

namespace dlcs {

// The section "time-stepping": κ, the step bounds 1/κ and 1/(3κ), γ and γ_1 of the first step on the grid of `options`,
// (4.1), whether Newton's method is sure to converge with these steps, and T_0 of Theorem 4.1, all of [Chen & Xiang
// 2013]. The problem is valid, of any class; a constant that is not known is absent, with the reason. A step longer
// than the bound is allowed; if the options ask for Newton's method, a warning says that its convergence is not
// guaranteed.
// Cost: 258 LCPs at x0, up to seven linear programs of n rows.
AnalysisSection TimeSteppingSection(const Problem& problem, const Options& options, const MatrixClass& matrix_class,
                                    Selection selection);

// The section "relative-degree", for M with zero rows: the degree of each such constraint, with warnings from degree
// two on and where y never reaches it (core/matrix_classes/relative_degree.h), unless y is a function of x.
AnalysisSection RelativeDegreeSection(const Problem& problem, Selection selection);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_TIME_STEPPING_SECTION_H_
