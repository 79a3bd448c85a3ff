// SPDX-License-Identifier: Apache-2.0
// The classes of a matrix for people and programs.

#ifndef DLCS_CORE_ANALYSIS_CLASS_SECTION_H_
#define DLCS_CORE_ANALYSIS_CLASS_SECTION_H_

#include "core/analysis/findings.h"
#include "core/types.h"

namespace dlcs {

// ProfileOf() for people and programs.
AnalysisSection ClassSection(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_CLASS_SECTION_H_
