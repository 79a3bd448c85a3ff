// SPDX-License-Identifier: Apache-2.0
// An analysis on paper: a table for people, JSON for programs.

#ifndef DLCS_CLIENT_CLI_ANALYSIS_OUTPUT_H_
#define DLCS_CLIENT_CLI_ANALYSIS_OUTPUT_H_

#include <cstdio>
#include <string>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// One object: name, states, constraints, horizon, matrix_class, rule, sections, recommendation, warnings,
// seconds. `sections` is an object keyed by the ids of the sections, and holds `findings` and `constants`
// keyed by theirs, so that a program asks for .sections["matrix-class"].findings.p.answer ("yes", "no",
// "unknown"). Matrices are lists of rows, indices count from 0. A value that is not known is null, an
// infinite one "inf" or "-inf".
void PrintAnalysisJson(const std::string& name, const v1::AnalyzeProblemResponse& analysis, std::FILE* out);

// Head, sections, recommendation, warnings, in lines of `width` letters at most where words allow it.
// `source` is the problem file as it stands on the command line that is recommended.
void PrintAnalysisTable(const std::string& name, const std::string& source,
                        const v1::AnalyzeProblemResponse& analysis, int width, std::FILE* out);

// The command that follows the recommendation: `dlcs solve FILE --method ... --step ...`.
std::string RecommendedCommand(const std::string& source, const v1::SolveOptions& options);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_ANALYSIS_OUTPUT_H_
