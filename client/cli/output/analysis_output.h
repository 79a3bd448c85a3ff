// SPDX-License-Identifier: Apache-2.0
// An analysis on paper: a table for people (JSON: message_json.h).

#ifndef DLCS_CLIENT_CLI_OUTPUT_ANALYSIS_OUTPUT_H_
#define DLCS_CLIENT_CLI_OUTPUT_ANALYSIS_OUTPUT_H_

#include <cstdio>
#include <optional>
#include <string>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// What was typed and stands again on the command line that is recommended.
struct Asked {
  std::string source;                                   // the problem file, or the name of an uploaded one
  std::string server = {};                              // of an uploaded one
  std::optional<v1::SolutionRule> rule = std::nullopt;  // where it overrides the file's
  std::string grid = {};                                // of --grid, where it was given
};

// How much of an analysis is printed: every finding, witness, constant and source, or what a person reads
// first. Briefly, answers that follow from others stand in one line, and so does what is unknown.
enum class Detail { kBrief, kWhole };

// What the matrix is, which solution is meant, what to run, and what to take care of; then the sections. In
// lines of `width` letters at most where words allow it. Yes comes before no, and what is unknown last.
void PrintAnalysisTable(const std::string& name, const Asked& asked,
                        const v1::AnalyzeProblemResponse& analysis, Detail detail, int width, std::FILE* out);

// One section of it, without its warnings.
void PrintSection(const v1::AnalysisSection& section, Detail detail, int width, std::FILE* out);

// The command that follows the recommendation: `dlcs solve FILE --method ... --step ...`.
std::string RecommendedCommand(const Asked& asked, const v1::SolveOptions& options);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_ANALYSIS_OUTPUT_H_
