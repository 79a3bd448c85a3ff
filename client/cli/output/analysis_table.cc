// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <string>

#include "client/cli/options/solve_option_table.h"
#include "client/cli/output/analysis_output.h"
#include "client/cli/terminal/words.h"
#include "client/cli/terminal/wrapped_text.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

// `word` for a shell: quoted if it contains characters that are special in some shell.
std::string ShellWord(const std::string& text) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-+:,@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

constexpr const char* kLabel = "  {:<10} ";

void PrintHead(const std::string& name, const Asked& asked, const v1::AnalyzeProblemResponse& analysis,
               Paragraphs& paper) {
  paper.Line(fmt::format("{}: {}, {}, T = {}", name, Count(analysis.states(), "state"),
                         Count(analysis.constraints(), "pair"), analysis.horizon()));
  const auto print = [&paper](const char* head, const std::string& text) {
    paper.Print(fmt::format(kLabel, head), text);
  };
  print("M", analysis.matrix_class());
  print("Solution", analysis.rule());
  const v1::Recommendation& recommendation = analysis.recommendation();
  if (recommendation.refusal().empty()) {
    paper.Line(fmt::format(kLabel, "Run") + RecommendedCommand(asked, recommendation.options()));
    for (const std::string& reason : recommendation.reasons()) print("", reason);
  } else {
    print("No method", recommendation.refusal());
  }
  for (const std::string& warning : analysis.warnings()) print("Take care", warning);
}

}  // namespace

std::string RecommendedCommand(const Asked& asked, const v1::SolveOptions& options) {
  std::string command = "dlcs solve " + ShellWord(asked.source);
  if (!asked.server.empty()) command += " --server " + ShellWord(asked.server);
  if (asked.rule) command += " --rule " + Word(*asked.rule);
  for (const std::string& word : AsTyped(options, asked.grid)) command += " " + ShellWord(word);
  return command;
}

void PrintAnalysisTable(const std::string& name, const Asked& asked, const v1::AnalyzeProblemResponse& analysis,
                        Detail detail, int width, std::FILE* out) {
  Paragraphs paper(width, out);
  PrintHead(name, asked, analysis, paper);
  for (const v1::AnalysisSection& section : analysis.sections()) {
    paper.Line("");
    PrintSection(section, detail, width, out);
  }
  if (detail == Detail::kBrief)
    paper.Line("\nWitnesses, reasons and sources: --verbose, or --format json for programs.");
}

}  // namespace dlcs::client
