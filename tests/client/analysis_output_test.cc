// SPDX-License-Identifier: Apache-2.0
#include "client/cli/analysis_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

namespace dlcs::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

template <typename Print>
std::string Printed(const Print& print) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* stream = open_memstream(&text, &size);
  print(stream);
  std::fclose(stream);
  const std::string result(text, size);
  std::free(text);
  return result;
}

v1::Finding& AddFinding(v1::AnalysisSection& section, const char* id, v1::Answer answer,
                        const std::string& why) {
  v1::Finding& finding = *section.add_findings();
  finding.set_id(id);
  finding.set_title(std::string(id) + "-matrix");
  finding.set_answer(answer);
  finding.set_why(why);
  return finding;
}

v1::AnalyzeProblemResponse Example() {
  v1::AnalyzeProblemResponse analysis;
  analysis.set_states(2);
  analysis.set_constraints(1);
  analysis.set_horizon(4);
  analysis.set_matrix_class("Z-matrix");
  analysis.set_rule("the least element (M is a Z-matrix)");
  v1::AnalysisSection& section = *analysis.add_sections();
  section.set_id("matrix-class");
  section.set_title("Classes of M");
  AddFinding(section, "s", v1::ANSWER_UNKNOWN,
             "n = 40 is beyond the exact test and no sufficient test applies to this matrix");
  v1::Finding& p = AddFinding(section, "p", v1::ANSWER_NO, "a principal minor is negative");
  p.mutable_witness()->add_indices(0);
  p.mutable_witness()->add_indices(2);
  p.mutable_witness()->set_value(-2.5);
  p.set_source("(2.1) of [X]");
  AddFinding(section, "z", v1::ANSWER_YES, "no positive entry off the diagonal");
  v1::Constant& kappa = *section.add_constants();
  kappa.set_id("kappa");
  kappa.set_symbol("κ");
  kappa.set_title("Lipschitz constant");
  kappa.set_value(8);
  kappa.set_kind(v1::CONSTANT_KIND_UPPER_BOUND);
  v1::Constant& bound = *section.add_constants();
  bound.set_id("bound");
  bound.set_symbol("L");
  bound.set_title("constant");
  bound.set_value(std::numeric_limits<double>::infinity());
  bound.set_kind(v1::CONSTANT_KIND_EXACT);
  v1::Constant& absent = *section.add_constants();
  absent.set_id("absent");
  absent.set_symbol("v");
  absent.set_title("comparison");
  absent.set_kind(v1::CONSTANT_KIND_EXACT);
  absent.set_why("M is no P-matrix");
  v1::Recommendation& recommendation = *analysis.mutable_recommendation();
  recommendation.mutable_options()->set_method(v1::METHOD_EXPONENTIAL_MARCH);
  recommendation.mutable_options()->set_step(0.001);
  recommendation.add_reasons("It serves every class.");
  analysis.add_warnings("The state at 0 is inconsistent.");
  return analysis;
}

TEST(AnalysisTableTest, ReadsFromTheStrongestToTheUnknown) {
  const std::string text = Printed(
      [](std::FILE* out) { PrintAnalysisTable("case", {.source = "case.json"}, Example(), 100, out); });
  EXPECT_THAT(text, HasSubstr("case: 2 states, 1 pair, T = 4\n"));
  EXPECT_LT(text.find("z-matrix"), text.find("p-matrix"));
  EXPECT_LT(text.find("p-matrix"), text.find("s-matrix"));
  EXPECT_THAT(text, HasSubstr("a principal minor is negative [S = {0, 2}: value -2.5] [(2.1) of [X]]"));
  EXPECT_THAT(text, HasSubstr("  κ <= 8       Lipschitz constant\n"));
  EXPECT_THAT(text, HasSubstr("  L = inf      constant\n"));
  EXPECT_THAT(text, HasSubstr("  v not known  comparison; M is no P-matrix\n"));
  EXPECT_THAT(text, HasSubstr("\n  dlcs solve case.json --method exponential-march --step 0.001\n"));
  EXPECT_THAT(text, HasSubstr("- The state at 0 is inconsistent."));
}

TEST(AnalysisTableTest, SaysWhatIsUnknownInOneLineCutToTheWidth) {
  for (const int width : {48, 50, 60}) {
    v1::AnalyzeProblemResponse analysis = Example();
    analysis.mutable_sections(0)->mutable_findings(0)->set_why(
        "κκκκκκκκ κκκκκκκκκκ κκκκκκκκκκκκ κκκκκκκκκκκκκκκ");
    const std::string text = Printed(
        [&](std::FILE* out) { PrintAnalysisTable("case", {.source = "f.json"}, analysis, width, out); });
    const std::size_t begin = text.find("  unknown");
    const std::string line = text.substr(begin, text.find('\n', begin) - begin);
    std::size_t letters = 0;
    for (const char c : line) letters += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
    EXPECT_LE(letters, static_cast<std::size_t>(width)) << line;
    EXPECT_EQ(line.substr(line.size() - 3), "…") << line;
  }
}

TEST(AnalysisTableTest, KeepsToTheWidthOfTheTerminal) {
  for (const int width : {60, 80, 100}) {
    std::istringstream lines(Printed(
        [&](std::FILE* out) { PrintAnalysisTable("case", {.source = "f.json"}, Example(), width, out); }));
    for (std::string line; std::getline(lines, line);) {
      if (line.find("dlcs solve") != std::string::npos) continue;  // a command is copied whole
      std::size_t letters = 0;
      for (const char c : line) letters += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
      EXPECT_LE(letters, static_cast<std::size_t>(width)) << line;
    }
  }
}

TEST(AnalysisTableTest, SaysWhyNoMethodServes) {
  v1::AnalyzeProblemResponse analysis = Example();
  analysis.mutable_recommendation()->set_refusal("The relative degree is 3.");
  const std::string text = Printed(
      [&](std::FILE* out) { PrintAnalysisTable("case", {.source = "case.json"}, analysis, 100, out); });
  EXPECT_THAT(text, HasSubstr("The relative degree is 3."));
  EXPECT_THAT(text, Not(HasSubstr("dlcs solve")));
}

TEST(AnalysisJsonTest, IsKeyedByIds) {
  const auto root =
      nlohmann::json::parse(Printed([](std::FILE* out) { PrintAnalysisJson("case", Example(), out); }));
  const auto& section = root["sections"]["matrix-class"];
  EXPECT_EQ(section["findings"]["p"]["answer"], "no");
  EXPECT_EQ(section["findings"]["p"]["witness"]["indices"], nlohmann::json({0, 2}));
  EXPECT_EQ(section["findings"]["p"]["witness"]["value"], -2.5);
  EXPECT_EQ(section["findings"]["z"]["witness"], nullptr);
  EXPECT_EQ(section["findings"]["s"]["answer"], "unknown");
  EXPECT_EQ(section["constants"]["kappa"]["kind"], "upper-bound");
  EXPECT_EQ(section["constants"]["bound"]["value"], "inf");
  EXPECT_EQ(section["constants"]["absent"]["value"], nullptr);
  EXPECT_EQ(root["recommendation"]["method"], "exponential-march");
}

TEST(RecommendedCommandTest, IsReadByAShell) {
  v1::SolveOptions options;
  options.set_steps(500);
  options.set_window_steps(-1);
  options.set_project_initial_state(true);
  EXPECT_EQ(RecommendedCommand({.source = "it's here.json"}, options),
            "dlcs solve 'it'\\''s here.json' --steps 500 --window whole --project-initial-state");
}

TEST(RecommendedCommandTest, RepeatsTheRuleAndTheGridAsTyped) {
  v1::SolveOptions options;
  options.mutable_grid_times()->add_times(0.5);
  EXPECT_EQ(RecommendedCommand(
                {.source = "a.json", .rule = v1::SOLUTION_RULE_LEAST_ELEMENT, .grid = "my nodes"}, options),
            "dlcs solve a.json --rule least-element --grid 'my nodes'");
}

}  // namespace
}  // namespace dlcs::client
