// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/analysis_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/client/cli/printed.h"

namespace dlcs::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

v1::Finding& AddFinding(v1::AnalysisSection& section, const char* id, v1::Answer answer, const std::string& why) {
  v1::Finding& finding = *section.add_findings();
  finding.set_id(id);
  finding.set_title(std::string(id) + "-matrix");
  finding.set_answer(answer);
  finding.set_reason(why);
  return finding;
}

v1::AnalyzeProblemResponse AnalysisExample() {
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
  absent.set_reason("M is no P-matrix");
  v1::Recommendation& recommendation = *analysis.mutable_recommendation();
  recommendation.mutable_options()->set_method(v1::METHOD_EXPONENTIAL_INTEGRATOR);
  recommendation.mutable_options()->set_step(0.001);
  recommendation.add_reasons("It serves every class.");
  analysis.add_warnings("The state at 0 is inconsistent.");
  return analysis;
}

std::string Table(const v1::AnalyzeProblemResponse& analysis, Detail detail, int width = 100) {
  return Printed(
      [&](std::FILE* out) { PrintAnalysisTable("case", {.source = "case.json"}, analysis, detail, width, out); });
}

TEST(AnalysisTableTest, SaysFirstWhatToRunAndWhatToTakeCareOf) {
  const std::string text = Table(AnalysisExample(), Detail::kBrief);
  EXPECT_THAT(text, HasSubstr("case: 2 states, 1 pair, T = 4\n"
                              "  M          Z-matrix\n"
                              "  Solution   the least element (M is a Z-matrix)\n"
                              "  Run        dlcs solve case.json --method exponential-integrator --step 0.001\n"
                              "             It serves every class.\n"
                              "  Take care  The state at 0 is inconsistent.\n"));
}

TEST(AnalysisTableTest, TellsEverythingWhereAsked) {
  const std::string text = Table(AnalysisExample(), Detail::kWhole);
  EXPECT_LT(text.find("z-matrix"), text.find("p-matrix"));
  EXPECT_LT(text.find("p-matrix"), text.find("s-matrix"));
  EXPECT_THAT(text, HasSubstr("a principal minor is negative [S = {0, 2}: value -2.5] [(2.1) of [X]]"));
  EXPECT_THAT(text, HasSubstr("n = 40 is beyond the exact test"));
  EXPECT_THAT(text, HasSubstr("  κ <= 8       Lipschitz constant\n"));
  EXPECT_THAT(text, HasSubstr("  L = inf      constant\n"));
  EXPECT_THAT(text, HasSubstr("  v not known  comparison; M is no P-matrix\n"));
}

TEST(AnalysisTableTest, LeavesWitnessesAndSourcesToThoseWhoAsk) {
  const std::string text = Table(AnalysisExample(), Detail::kBrief);
  EXPECT_THAT(text, HasSubstr("  no       p-matrix  a principal minor is negative\n"));
  EXPECT_THAT(text, HasSubstr("  κ <= 8   Lipschitz constant\n"));
  EXPECT_THAT(text, HasSubstr("  unknown  s-matrix; v\n"));
  EXPECT_THAT(text, HasSubstr("--verbose"));
}

TEST(AnalysisTableTest, PutsWhatFollowsInOneLine) {
  v1::AnalyzeProblemResponse analysis = AnalysisExample();
  v1::AnalysisSection& section = *analysis.mutable_sections(0);
  section.clear_findings();
  AddFinding(section, "p", v1::ANSWER_YES, "all minors are positive");
  AddFinding(section, "p0", v1::ANSWER_YES, "a P-matrix");
  AddFinding(section, "q", v1::ANSWER_YES, "a P-matrix").set_title("Q-matrix: LCP(q, M) has a solution for every q");
  AddFinding(section, "z", v1::ANSWER_NO, "M[0][1] is positive");
  AddFinding(section, "m", v1::ANSWER_NO, "M[0][1] is positive");
  const std::string text = Table(analysis, Detail::kBrief);
  EXPECT_THAT(text, HasSubstr("  yes      p-matrix   all minors are positive\n  yes      hence p0-matrix, Q-matrix\n"));
  EXPECT_THAT(text, HasSubstr("  no       z-matrix   M[0][1] is positive\n  no       hence m-matrix\n"));
  EXPECT_THAT(Table(analysis, Detail::kWhole), HasSubstr("(LCP(q, M) has a solution for every q) a P-matrix"));
}

TEST(AnalysisTableTest, KeepsToTheWidthOfTheTerminal) {
  for (const Detail detail : {Detail::kBrief, Detail::kWhole}) {
    for (const int width : {60, 80, 100}) {
      std::istringstream lines(Table(AnalysisExample(), detail, width));
      for (std::string line; std::getline(lines, line);) {
        if (line.find("dlcs solve") != std::string::npos) continue;  // a command is copied whole
        if (line.find("--verbose") != std::string::npos) continue;
        std::size_t letters = 0;
        for (const char c : line) letters += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
        EXPECT_LE(letters, static_cast<std::size_t>(width)) << line;
      }
    }
  }
}

TEST(AnalysisTableTest, SaysWhyNoMethodServes) {
  v1::AnalyzeProblemResponse analysis = AnalysisExample();
  analysis.mutable_recommendation()->set_refusal("The relative degree is 3.");
  const std::string text = Table(analysis, Detail::kBrief);
  EXPECT_THAT(text, HasSubstr("  No method  The relative degree is 3.\n"));
  EXPECT_THAT(text, Not(HasSubstr("dlcs solve")));
}

TEST(RecommendedCommandTest, IsReadByAShell) {
  v1::SolveOptions options;
  options.set_steps(500);
  options.set_window_steps(-1);
  options.set_project_initial_state(true);
  EXPECT_EQ(RecommendedCommand({.source = "it's here.json"}, options),
            "dlcs solve 'it'\\''s here.json' --steps 500 --project-initial-state --window whole");
}

TEST(RecommendedCommandTest, RepeatsTheRuleAndTheGridAsTyped) {
  v1::SolveOptions options;
  options.mutable_grid_times()->add_times(0.5);
  EXPECT_EQ(
      RecommendedCommand({.source = "a.json", .rule = v1::SOLUTION_RULE_LEAST_ELEMENT, .grid = "my nodes"}, options),
      "dlcs solve a.json --rule least-element --grid 'my nodes'");
}

}  // namespace
}  // namespace dlcs::client
