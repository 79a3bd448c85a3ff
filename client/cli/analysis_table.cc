// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/analysis_output.h"
#include "client/cli/words.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

// The longest index set or vector that a line shows whole.
constexpr int kMaxListed = 12;

// Of a UTF-8 character that began before.
bool IsContinuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

// Letters on the screen.
std::size_t LetterCount(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return !IsContinuation(c); }));
}

std::string Padded(const std::string& text, std::size_t width) {
  const std::size_t letters = LetterCount(text);
  return text + std::string(letters < width ? width - letters : 0, ' ');
}

// Writes paragraphs: `head` on the first line, as many blanks on those that follow.
class Paragraphs {
 public:
  Paragraphs(int width, std::FILE* out) : width_(static_cast<std::size_t>(std::max(width, 40))), out_(out) {}

  void Line(const std::string& text) { fmt::print(out_, "{}\n", text); }

  // One line, cut to the width.
  void Quiet(const std::string& text) {
    if (LetterCount(text) <= width_) return Line(text);
    std::size_t end = 0;
    for (std::size_t letters = 0; letters < width_ - 1; ++letters) {
      do ++end;
      while (IsContinuation(text[end]));
    }
    Line(text.substr(0, text.find_last_not_of(' ', end - 1) + 1) + "…");
  }

  void Print(const std::string& head, const std::string& text) {
    const std::size_t indent = LetterCount(head);
    std::string line = head;
    bool fresh = true;
    std::istringstream words(text);
    for (std::string word; words >> word; fresh = false) {
      if (!fresh && LetterCount(line) + 1 + LetterCount(word) > width_) {
        Line(line);
        line = std::string(indent, ' ');
        fresh = true;
      }
      line += (fresh ? "" : " ") + word;
    }
    Line(line);
  }

 private:
  std::size_t width_;
  std::FILE* out_;
};

template <typename Values>
std::string Listed(const Values& values, const char* form) {
  std::vector<std::string> cells;
  for (int k = 0; k < std::min<int>(values.size(), kMaxListed); ++k) {
    cells.push_back(fmt::format(fmt::runtime(form), values[k]));
  }
  if (values.size() > kMaxListed) cells.push_back(fmt::format("… {} in all", values.size()));
  return fmt::format("{}", fmt::join(cells, ", "));
}

// "S = {0, 2}: value -2.5, z = (1, -1)"; X and Y are for programs.
std::string WitnessText(const v1::Witness& witness) {
  std::vector<std::string> parts;
  if (witness.has_value()) parts.push_back(fmt::format("value {:.6g}", witness.value()));
  if (!witness.z().empty()) parts.push_back(fmt::format("z = ({})", Listed(witness.z(), "{:.6g}")));
  if (witness.has_x()) parts.push_back("X, Y, r and s of M X = Y in the JSON");
  const std::string rest = fmt::format("{}", fmt::join(parts, ", "));
  if (witness.indices().empty()) return rest;
  const std::string set = fmt::format("S = {{{}}}", Listed(witness.indices(), "{}"));
  return rest.empty() ? set : fmt::format("{}: {}", set, rest);
}

// Why, with the witness and the source in brackets, as far as there are any.
std::string Grounds(const v1::Finding& finding) {
  std::string text = finding.why();
  const std::string witness = finding.has_witness() ? WitnessText(finding.witness()) : "";
  for (const std::string& more : {witness, finding.source()}) {
    if (!more.empty()) text += fmt::format("{}[{}]", text.empty() ? "" : " ", more);
  }
  return text;
}

std::size_t TitleWidth(const v1::AnalysisSection& section) {
  constexpr std::size_t kLongest = 32;  // a longer title pushes its own line only
  std::size_t width = 0;
  for (const v1::Finding& finding : section.findings()) {
    if (const std::size_t letters = LetterCount(finding.title()); letters <= kLongest)
      width = std::max(width, letters);
  }
  return width;
}

void PrintFindings(const v1::AnalysisSection& section, Paragraphs& paper) {
  const std::size_t width = TitleWidth(section);
  for (const v1::Answer answer : {v1::ANSWER_YES, v1::ANSWER_NO, v1::ANSWER_UNKNOWN}) {
    for (const v1::Finding& finding : section.findings()) {
      if (finding.answer() != answer) continue;
      const std::string head =
          fmt::format("  {:<8} {}  ", AnswerName(answer), Padded(finding.title(), width));
      if (answer == v1::ANSWER_UNKNOWN) {
        paper.Quiet(head + finding.why());
      } else {
        paper.Print(head, Grounds(finding));
      }
    }
  }
}

std::string ValueText(const v1::Constant& constant) {
  if (!constant.has_value()) return constant.symbol() + " not known";
  const char* relation = constant.kind() == v1::CONSTANT_KIND_UPPER_BOUND   ? "<="
                         : constant.kind() == v1::CONSTANT_KIND_LOWER_BOUND ? ">="
                         : constant.kind() == v1::CONSTANT_KIND_ESTIMATE    ? "≈"
                                                                            : "=";
  return fmt::format("{} {} {:.6g}", constant.symbol(), relation, constant.value());
}

void PrintConstants(const v1::AnalysisSection& section, Paragraphs& paper) {
  std::size_t width = 0;
  for (const v1::Constant& constant : section.constants())
    width = std::max(width, LetterCount(ValueText(constant)));
  for (const v1::Constant& constant : section.constants()) {
    std::string text = constant.title();
    if (!constant.why().empty()) text += "; " + constant.why();
    if (!constant.source().empty()) text += " [" + constant.source() + "]";
    paper.Print(fmt::format("  {}  ", Padded(ValueText(constant), width)), text);
  }
}

void PrintSection(const v1::AnalysisSection& section, Paragraphs& paper) {
  paper.Line(section.title());
  PrintFindings(section, paper);
  PrintConstants(section, paper);
}

void PrintRecommendation(const Asked& asked, const v1::Recommendation& recommendation, Paragraphs& paper) {
  if (!recommendation.refusal().empty()) {
    paper.Line("\nNot solvable here");
    return paper.Print("  ", recommendation.refusal());
  }
  paper.Line("\nRecommended");
  paper.Line("  " + RecommendedCommand(asked, recommendation.options()));
  for (const std::string& reason : recommendation.reasons()) paper.Print("  - ", reason);
}

// As a shell reads it: quoted where it holds anything but letters that every shell leaves alone.
std::string ShellWord(const std::string& text) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-+:,@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace

std::string RecommendedCommand(const Asked& asked, const v1::SolveOptions& options) {
  const v1::SolveOptions unset;
  std::string command = "dlcs solve " + ShellWord(asked.source);
  if (asked.rule) command += " --rule " + RuleName(*asked.rule);
  if (options.method() != unset.method()) command += " --method " + MethodName(options.method());
  if (options.has_steps()) command += fmt::format(" --steps {}", options.steps());
  if (options.has_step()) command += fmt::format(" --step {}", options.step());
  if (options.has_grid_times()) command += " --grid " + ShellWord(asked.grid);
  if (!options.output_times().empty())
    command += fmt::format(" --at {}", fmt::join(options.output_times(), ","));
  if (options.theta() != 0) command += fmt::format(" --theta {}", options.theta());
  if (options.step_solver() == v1::STEP_SOLVER_NEWTON) command += " --step-solver newton";
  if (options.average_y()) command += " --average-y";
  if (options.window_steps() == -1) command += " --window whole";
  if (options.window_steps() > 0) command += fmt::format(" --window {}", options.window_steps());
  if (options.project_initial_state()) command += " --project-initial-state";
  if (options.inelastic_impact()) command += " --inelastic-impact";
  return command;
}

void PrintSection(const v1::AnalysisSection& section, int width, std::FILE* out) {
  Paragraphs paper(width, out);
  PrintSection(section, paper);
  for (const std::string& warning : section.warnings()) paper.Print("  - ", warning);
}

void PrintAnalysisTable(const std::string& name, const Asked& asked,
                        const v1::AnalyzeProblemResponse& analysis, int width, std::FILE* out) {
  Paragraphs paper(width, out);
  paper.Line(fmt::format("{}: {}, {}, T = {}", name, Count(analysis.states(), "state"),
                         Count(analysis.constraints(), "pair"), analysis.horizon()));
  paper.Print("M      ", analysis.matrix_class());
  paper.Print("Rule   ", analysis.rule());
  for (const v1::AnalysisSection& section : analysis.sections()) {
    paper.Line("");
    PrintSection(section, paper);
  }
  PrintRecommendation(asked, analysis.recommendation(), paper);
  if (!analysis.warnings().empty()) paper.Line("\nWarnings");
  for (const std::string& warning : analysis.warnings()) paper.Print("  - ", warning);
}

}  // namespace dlcs::client
