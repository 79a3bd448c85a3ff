// SPDX-License-Identifier: Apache-2.0
// What is known about constraints on the state alone.

#ifndef DLCS_CORE_ANALYSIS_RELATIVE_DEGREE_SECTION_H_
#define DLCS_CORE_ANALYSIS_RELATIVE_DEGREE_SECTION_H_

#include "core/analysis/findings.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/problem.h"

namespace dlcs {

// The section "relative-degree", for M with zero rows: the degree of each such constraint, with warnings from degree
// two on and where y never reaches it (core/matrix_classes/relative_degree.h), unless y is a function of x.
AnalysisSection RelativeDegreeSection(const Problem& problem, Selection selection);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_RELATIVE_DEGREE_SECTION_H_
