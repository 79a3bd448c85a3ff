// SPDX-License-Identifier: Apache-2.0
// Prints an analysis as a table. (For JSON see message_json.h.)

#ifndef DLCS_CLIENT_CLI_OUTPUT_ANALYSIS_OUTPUT_H_
#define DLCS_CLIENT_CLI_OUTPUT_ANALYSIS_OUTPUT_H_

#include <cstdio>
#include <optional>
#include <string>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Parts of the typed command line that the recommended one repeats.
struct Asked {
  std::string source;                                   // the problem file, or the name of an uploaded one
  std::string server = {};                              // the server of an uploaded problem
  std::optional<v1::SolutionRule> rule = std::nullopt;  // if it overrides that of the file
  std::string grid = {};                                // the value of --grid, if it was given
};

// How much of an analysis is printed. kWhole: every finding, witness, constant and source. kBrief: the main results;
// answers that follow from others, and unknown ones, are combined into one line each.
enum class Detail { kBrief, kWhole };

// Prints the class of the matrix, the selected solution, the recommended command and warnings; then the sections, in
// which yes comes before no, and unknown last. Lines have at most `width` characters, unless a word is longer.
void PrintAnalysisTable(const std::string& name, const Asked& asked, const v1::AnalyzeProblemResponse& analysis,
                        Detail detail, int width, std::FILE* out);

// Prints one section, without its warnings.
void PrintSection(const v1::AnalysisSection& section, Detail detail, int width, std::FILE* out);

// The command that follows the recommendation: `dlcs solve FILE --method ... --step ...`.
std::string RecommendedCommand(const Asked& asked, const v1::SolveOptions& options);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_ANALYSIS_OUTPUT_H_
