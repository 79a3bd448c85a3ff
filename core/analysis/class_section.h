// SPDX-License-Identifier: Apache-2.0
// The classes of a matrix as a section of an analysis.

#ifndef DLCS_CORE_ANALYSIS_CLASS_SECTION_H_
#define DLCS_CORE_ANALYSIS_CLASS_SECTION_H_

#include "core/analysis/findings.h"
#include "core/types.h"

namespace dlcs {

// The result of ProfileOf() as a section: a finding for each class.
AnalysisSection ClassSection(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_CLASS_SECTION_H_
