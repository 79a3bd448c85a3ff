// SPDX-License-Identifier: Apache-2.0
// What [Shen & Pang 2007] says about a problem with M = 0.

#ifndef DLCS_CORE_ANALYSIS_INDEX_ONE_SECTION_H_
#define DLCS_CORE_ANALYSIS_INDEX_ONE_SECTION_H_

#include <stop_token>

#include "core/analysis/findings.h"
#include "core/problem/problem.h"

namespace dlcs {

// The section "index-one": is NB strictly semicopositive and of type I, the bounds of Theorems 7 and 9,
// membership of x0 in the semiobservability cone and the unobservable subspace, and what follows for
// existence and uniqueness. For a sound problem with M = 0. What is stated for f = g = 0
// only is unknown for others, and says so.
// A stopped analysis holds smaller times ε_1 and ε_2.
AnalysisSection IndexOneSection(const Problem& problem, std::stop_token stop = {});

// Whether `function` is zero for all times as far as its data show it: constants, samples and polynomials of
// zeros, and formulas that are the number 0.
bool IsZeroByItsData(const TimeFunction& function);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_INDEX_ONE_SECTION_H_
