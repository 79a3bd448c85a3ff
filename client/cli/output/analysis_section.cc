// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <vector>

#include "client/cli/output/analysis_output.h"
#include "client/cli/output/class_implications.h"
#include "client/cli/terminal/wrapped_text.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

// The longest index set or vector that a line shows completely.
constexpr int kMaxNumbers = 12;
// A longer title is printed before its text instead of in a column.
constexpr std::size_t kLongestTitle = 24;

template <typename Values>
std::string ListedAs(const Values& values, const char* form) {
  std::vector<std::string> cells;
  for (int k = 0; k < std::min<int>(values.size(), kMaxNumbers); ++k) {
    cells.push_back(fmt::format(fmt::runtime(form), values[k]));
  }
  if (values.size() > kMaxNumbers) cells.push_back(fmt::format("… {} in all", values.size()));
  return fmt::format("{}", fmt::join(cells, ", "));
}

// "S = {0, 2}: value -2.5, z = (1, -1)"; X and Y are only in the JSON.
std::string WitnessText(const v1::Witness& witness) {
  std::vector<std::string> parts;
  if (witness.has_value()) parts.push_back(fmt::format("value {:.6g}", witness.value()));
  if (!witness.z().empty()) parts.push_back(fmt::format("z = ({})", ListedAs(witness.z(), "{:.6g}")));
  if (witness.has_x()) parts.push_back("X, Y, r and s of M X = Y in the JSON");
  const std::string rest = fmt::format("{}", fmt::join(parts, ", "));
  if (witness.indices().empty()) return rest;
  const std::string set = fmt::format("S = {{{}}}", ListedAs(witness.indices(), "{}"));
  return rest.empty() ? set : fmt::format("{}: {}", set, rest);
}

// The reason, with the witness and the source in brackets, if there are any.
std::string Grounds(const v1::Finding& finding) {
  std::string text = finding.reason();
  const std::string witness = finding.has_witness() ? WitnessText(finding.witness()) : "";
  for (const std::string& more : {witness, finding.source()}) {
    if (!more.empty()) text += fmt::format("{}[{}]", text.empty() ? "" : " ", more);
  }
  return text;
}

std::string ValueText(const v1::Constant& constant) {
  if (!constant.has_value()) return constant.symbol() + " not known";
  const char* relation = constant.kind() == v1::CONSTANT_KIND_UPPER_BOUND   ? "<="
                         : constant.kind() == v1::CONSTANT_KIND_LOWER_BOUND ? ">="
                         : constant.kind() == v1::CONSTANT_KIND_ESTIMATE    ? "≈"
                                                                            : "=";
  if (constant.symbol().empty()) return fmt::format("{:.6g}", constant.value());
  return fmt::format("{} {} {:.6g}", constant.symbol(), relation, constant.value());
}

// Splits "P-matrix: all principal minors are positive" at the colon.
std::string Label(const v1::Finding& finding) { return finding.title().substr(0, finding.title().find(": ")); }
std::string Meaning(const v1::Finding& finding) {
  const std::size_t colon = finding.title().find(": ");
  return colon == std::string::npos ? "" : finding.title().substr(colon + 2);
}

// No column where one of the titles is too long for it.
std::size_t LabelWidth(const v1::AnalysisSection& section) {
  std::size_t width = 0;
  for (const v1::Finding& finding : section.findings()) width = std::max(width, LetterCount(Label(finding)));
  return width <= kLongestTitle ? width : 0;
}

// "  yes      P-matrix   ...", the text in a column of its own.
void PrintRow(const char* answer, const std::string& label, std::size_t width, const std::string& text,
              Paragraphs& paper) {
  if (LetterCount(label) > width) return paper.Print(fmt::format("  {:<8} ", answer), label + ": " + text);
  paper.Print(fmt::format("  {:<8} {}  ", answer, Padded(label, width)), text);
}

void PrintFindingsWhole(const v1::AnalysisSection& section, Paragraphs& paper) {
  const std::size_t width = LabelWidth(section);
  for (const v1::Answer answer : {v1::ANSWER_YES, v1::ANSWER_NO, v1::ANSWER_UNKNOWN}) {
    for (const v1::Finding& finding : section.findings()) {
      if (finding.answer() != answer) continue;
      const std::string meaning = Meaning(finding);
      PrintRow(Word(answer).c_str(), Label(finding), width,
               meaning.empty() ? Grounds(finding) : fmt::format("({}) {}", meaning, Grounds(finding)), paper);
    }
  }
}

void PrintConstantsWhole(const v1::AnalysisSection& section, Paragraphs& paper) {
  std::size_t width = 0;
  for (const v1::Constant& constant : section.constants()) width = std::max(width, LetterCount(ValueText(constant)));
  for (const v1::Constant& constant : section.constants()) {
    std::string text = constant.title();
    if (!constant.reason().empty()) text += "; " + constant.reason();
    if (!constant.source().empty()) text += " [" + constant.source() + "]";
    paper.Print(fmt::format("  {}  ", Padded(ValueText(constant), width)), text);
  }
}

// Prints the answers that do not follow from others, and in one line those that do.
void PrintAnswer(const v1::AnalysisSection& section, v1::Answer answer, std::size_t width, Paragraphs& paper) {
  std::vector<std::string> following;
  for (const v1::Finding& finding : section.findings()) {
    if (finding.answer() != answer) continue;
    if (Follows(finding, section)) {
      following.push_back(Label(finding));
    } else {
      PrintRow(Word(answer).c_str(), Label(finding), width, finding.reason(), paper);
    }
  }
  if (!following.empty())
    paper.Print(fmt::format("  {:<8} ", Word(answer)), fmt::format("hence {}", fmt::join(following, ", ")));
}

void PrintBriefly(const v1::AnalysisSection& section, Paragraphs& paper) {
  const std::size_t width = LabelWidth(section);
  PrintAnswer(section, v1::ANSWER_YES, width, paper);
  PrintAnswer(section, v1::ANSWER_NO, width, paper);
  std::vector<std::string> unknown;
  for (const v1::Finding& finding : section.findings()) {
    if (finding.answer() == v1::ANSWER_UNKNOWN) unknown.push_back(Label(finding));
  }
  std::size_t value_width = 0;
  for (const v1::Constant& constant : section.constants()) {
    if (constant.has_value()) value_width = std::max(value_width, LetterCount(ValueText(constant)));
  }
  for (const v1::Constant& constant : section.constants()) {
    if (constant.has_value()) {
      paper.Print(fmt::format("  {}  ", Padded(ValueText(constant), value_width)), constant.title());
    } else {
      unknown.push_back(constant.symbol().empty() ? constant.title() : constant.symbol());
    }
  }
  if (!unknown.empty()) paper.Print("  unknown  ", fmt::format("{}", fmt::join(unknown, "; ")));
}

}  // namespace

void PrintSection(const v1::AnalysisSection& section, Detail detail, int width, std::FILE* out) {
  Paragraphs paper(width, out);
  paper.Line(section.title());
  if (detail == Detail::kWhole) {
    PrintFindingsWhole(section, paper);
    PrintConstantsWhole(section, paper);
  } else {
    PrintBriefly(section, paper);
  }
}

}  // namespace dlcs::client
