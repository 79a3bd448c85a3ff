// SPDX-License-Identifier: Apache-2.0
// What the analysis says of the solutions of LCP(N x + g, M).
#include "core/analysis/solution_section.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// q = N x0 + g(0) = `q`, whatever x0.
Problem ProblemWith(const Matrix& M, const Vector& q, SolutionRule rule = SolutionRule::kAuto) {
  Problem problem;
  const Index n = M.rows();
  problem.A = Matrix::Zero(1, 1);
  problem.B = Matrix::Zero(1, n);
  problem.N = Matrix::Ones(n, 1);
  problem.M = M;
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(q - Vector::Ones(n));
  problem.x0 = Vector::Ones(1);
  problem.horizon = 1;
  problem.rule = rule;
  return problem;
}

AnalysisSection SectionOf(const Problem& problem) {
  const MatrixClass matrix_class = Classify(problem.M, problem.rule);
  const auto selection = SelectRule(problem.rule, matrix_class);
  EXPECT_TRUE(selection.ok()) << selection.status();
  return SolutionSection(problem, matrix_class, *selection);
}

const Fact& FactOf(const AnalysisSection& section, const std::string& id) {
  const auto found = std::find_if(section.findings.begin(), section.findings.end(),
                                  [&](const Finding& finding) { return finding.id == id; });
  EXPECT_NE(found, section.findings.end()) << id;
  return found->fact;
}

const Constant& ConstantOf(const AnalysisSection& section, const std::string& id) {
  const auto found = std::find_if(section.constants.begin(), section.constants.end(),
                                  [&](const Constant& constant) { return constant.id == id; });
  EXPECT_NE(found, section.constants.end()) << id;
  return *found;
}

TEST(SolutionSectionTest, DescribesExample41AtAStateWithTwoSolutions) {
  const AnalysisSection section = SectionOf(ProblemWith(testing::ChenXiangExample41(), Vector{{-1.0, 1, 1, 1}}));
  EXPECT_EQ(*ConstantOf(section, "lipschitz").value, 1);
  EXPECT_GE(*ConstantOf(section, "mangasarian-shiau").value, 1);
  EXPECT_FALSE(ConstantOf(section, "cube-bound").value.has_value());
  EXPECT_EQ(*ConstantOf(section, "basic-solutions").value, 2);
  EXPECT_EQ(FactOf(section, "solvable").witness.z, (Vector{{1.0, 0, 0, 0}}));
  EXPECT_TRUE(FactOf(section, "unique").no());
  EXPECT_TRUE(FactOf(section, "degenerate").no());
  EXPECT_THAT(FactOf(section, "degenerate").why, HasSubstr("J = {0} (y > 0), I = {1, 2, 3} (w > 0), K = {}"));
  EXPECT_TRUE(FactOf(section, "differentiable").yes());
  EXPECT_TRUE(FactOf(section, "interior-point").yes());
  EXPECT_THAT(section.warnings, IsEmpty());  // the rule chooses
}

TEST(SolutionSectionTest, NamesTheDegenerateIndicesOfAPMatrix) {
  const AnalysisSection section = SectionOf(ProblemWith(Matrix{{2, 1}, {0, 1}}, Vector{{-1.0, 0}}));
  EXPECT_THAT(FactOf(section, "degenerate").witness.indices, ElementsAre(1));
  EXPECT_TRUE(FactOf(section, "differentiable").no());
  EXPECT_TRUE(FactOf(section, "unique").yes());
  EXPECT_EQ(*ConstantOf(section, "cube-bound").value, *ConstantOf(section, "lipschitz").value);
}

TEST(SolutionSectionTest, WarnsOfSeveralSolutionsWhereNoRuleChooses) {
  const AnalysisSection section = SectionOf(ProblemWith(Matrix::Ones(2, 2), Vector{{-1.0, -1}}));
  ASSERT_EQ(section.warnings.size(), 1u);
  EXPECT_THAT(section.warnings[0], HasSubstr("several solutions"));
  EXPECT_THAT(section.warnings[0], HasSubstr("and more on faces of singular bases"));
}

TEST(SolutionSectionTest, SaysThatThereIsNone) {
  const AnalysisSection section = SectionOf(ProblemWith(Matrix{{0, 1}, {-1, 0}}, Vector{{-1.0, -1}}));
  EXPECT_TRUE(FactOf(section, "solvable").no());
  EXPECT_TRUE(FactOf(section, "interior-point").no());
}

TEST(SolutionSectionTest, WarnsThatTheLeastNormMayJump) {
  const AnalysisSection section =
      SectionOf(ProblemWith(Matrix{{1, 1}, {0, -1}}, Vector{{-1.0, 1}}, SolutionRule::kLeastNorm));
  EXPECT_EQ(*ConstantOf(section, "slope").value, 2);  // M⁻¹ = M
  ASSERT_EQ(section.warnings.size(), 2u);
  EXPECT_THAT(section.warnings[0], HasSubstr("several solutions tie for the solution of least norm"));
  EXPECT_THAT(section.warnings[1], HasSubstr("Remark 2.1"));
}

}  // namespace
}  // namespace dlcs
