// SPDX-License-Identifier: Apache-2.0
// What [Shen & Pang 2007] says about a problem with M = 0.

#ifndef DLCS_CORE_ANALYSIS_INDEX_ONE_SECTION_H_
#define DLCS_CORE_ANALYSIS_INDEX_ONE_SECTION_H_

#include <stop_token>

#include "core/analysis/findings.h"
#include "core/problem/problem.h"

namespace dlcs {

// The section "index-one": is NB strictly semicopositive and of type I, the bounds of Theorems 7 and 9, membership of
// x0 in the semiobservability cone and the unobservable subspace, and what follows for existence and uniqueness.
// `problem` is valid and has M = 0. Statements that hold only for f = g = 0 are answered "unknown" for other sources.
// If the analysis is stopped, the times ε_1 and ε_2 are smaller.
AnalysisSection IndexOneSection(const Problem& problem, std::stop_token stop = {});

// Whether the data of `function` show that it is zero at all times: constants, samples and polynomials whose entries
// are all zero, and formulas that are the number 0.
bool IsZeroByItsData(const TimeFunction& function);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_INDEX_ONE_SECTION_H_
