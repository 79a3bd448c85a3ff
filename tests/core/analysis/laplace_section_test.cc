// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/laplace_section.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>

#include "core/analyze.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

AnalysisSection SectionOf(const Problem& problem, const Options& options) {
  const MatrixClass matrix_class = Classify(problem.M);
  return LaplaceSection(problem, options, matrix_class, *SelectRule(problem.rule, matrix_class));
}

std::optional<double> ValueOf(const AnalysisSection& section, const std::string& id) {
  for (const Constant& constant : section.constants) {
    if (constant.id == id) return constant.value;
  }
  ADD_FAILURE() << "no constant " << id;
  return std::nullopt;
}

TEST(LaplaceSectionTest, PredictsNoFewerIterationsThanAreNeeded) {
  Problem problem = testing::FourVariableEasy();
  problem.horizon = 0.05;
  Options options;
  options.method = Method::kWuChenIteration;
  options.num_steps = 16;
  const AnalysisSection section = SectionOf(problem, options);
  const auto predicted = ValueOf(section, "iterations");
  ASSERT_TRUE(predicted);
  Observer silent;
  const auto solution = Solve(problem, options, silent, {});
  ASSERT_TRUE(solution.ok());
  ASSERT_EQ(solution->termination, Termination::kReachedEnd);
  EXPECT_LE(static_cast<double>(solution->cost.iterations), *predicted + 2);
  for (const Constant& constant : section.constants) {
    if (constant.value) {
      EXPECT_FALSE(std::isnan(*constant.value)) << constant.id;
    }
    EXPECT_FALSE(constant.title.empty());
  }
}

TEST(LaplaceSectionTest, TheRecommendedWindowConvergesAsPredicted) {
  for (const Problem& problem : {testing::FourVariableEasy(), testing::ExampleFourOne()}) {
    Options options;
    options.num_steps = 1024;
    options.method = Method::kLaplaceIteration;
    const AnalysisSection section = SectionOf(problem, options);
    const auto window = ValueOf(section, "window"), count = ValueOf(section, "window-iterations");
    ASSERT_TRUE(window && count);
    options.window_steps = static_cast<Index>(*window);
    Observer silent;
    const auto solution = Solve(problem, options, silent, {});
    ASSERT_TRUE(solution.ok());
    ASSERT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
    EXPECT_LE(static_cast<double>(solution->cost.iterations),
              (*count + 2) * static_cast<double>(solution->cost.windows));
  }
}

TEST(LaplaceSectionTest, SaysWhereTheIterationsDoNotApply) {
  const AnalysisSection relay = SectionOf(testing::LoadCase("relay_sliding").problem, {});
  ASSERT_EQ(relay.findings.size(), 1u);
  EXPECT_TRUE(relay.findings[0].fact.no());
  EXPECT_TRUE(relay.constants.empty());
  const AnalysisSection unstable = SectionOf(testing::Scalar(1, -1, 0, 1), {});
  ASSERT_EQ(unstable.findings.size(), 2u);
  EXPECT_TRUE(unstable.findings[1].fact.no());
  EXPECT_NEAR(*ValueOf(unstable, "alpha"), M_PI, 1e-12);
}

TEST(LaplaceSectionTest, IsPartOfTheAnalysis) {
  const auto analysis = Analyze(testing::FourVariableEasy(), {}, {});
  ASSERT_TRUE(analysis.ok());
  bool found = false;
  for (const AnalysisSection& section : analysis->sections) found = found || section.id == "laplace-inversion";
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace dlcs
