// SPDX-License-Identifier: Apache-2.0
#include "core/models/input_output.h"

#include <gtest/gtest.h>

#include "core/linalg/norms.h"
#include "core/solve.h"

namespace dlcs {
namespace {

InputOutputModel Economy(const Matrix& C) {
  const Index n = C.rows();
  return {C, -Matrix::Identity(n, n), Matrix::Identity(n, n) / 4, Vector::Ones(n), 1.0, TimeFunction::Zero(n)};
}

TEST(InputOutputTest, SupplyCoversDemandByTheInverse) {
  const InputOutputModel model = Economy(Matrix{{0.2, 0.3}, {0.4, 0.1}});
  const auto problem = MakeInputOutputProblem(model);
  ASSERT_TRUE(problem.ok()) << problem.status();
  Options options;
  options.num_steps = 50;
  Observer observer;
  const auto solution = Solve(*problem, options, observer, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  ASSERT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
  // (4.6) with M⁻¹ >= 0 and x > 0: the supply is M⁻¹ x.
  EXPECT_LE(MaxAbs(problem->M * solution->y - solution->x), 1e-12);
  EXPECT_GT(solution->y.minCoeff(), 0);
}

TEST(InputOutputTest, StrictSumsGiveAnMMatrixAndAStepBound) {
  const InputOutputFacts facts = AnalyzeInputOutput(Economy(Matrix{{0.2, 0.3}, {0.4, 0.1}}));
  EXPECT_TRUE(facts.condition.yes());
  ASSERT_TRUE(facts.m_matrix.yes());
  EXPECT_GE(facts.m_matrix.witness.X.minCoeff(), 0);
  // By hand: det(I - C) = 0.6, (I - C)⁻¹ = [0.9 0.3; 0.4 0.8]/0.6, of norm 2; κ = 1 + 2/4.
  EXPECT_NEAR(*facts.kappa, 1.5, 1e-14);
  EXPECT_NEAR(*facts.step_bound, 1 / 4.5, 1e-14);
}

TEST(InputOutputTest, OneStrictSumNeedsIrreducibility) {
  const InputOutputFacts connected = AnalyzeInputOutput(Economy(Matrix{{0.5, 0.5}, {0.5, 0.25}}));
  EXPECT_TRUE(connected.irreducible.yes());
  EXPECT_TRUE(connected.columns_all_strict.no());
  EXPECT_TRUE(connected.condition.yes());
  EXPECT_TRUE(connected.m_matrix.yes());
  const InputOutputFacts apart = AnalyzeInputOutput(Economy(Matrix{{1, 0}, {0, 0.25}}));
  EXPECT_TRUE(apart.column_sums.yes());
  EXPECT_TRUE(apart.irreducible.no());
  EXPECT_TRUE(apart.condition.no());
  EXPECT_TRUE(apart.m_matrix.no());
  EXPECT_FALSE(apart.step_bound.has_value());
}

TEST(InputOutputTest, ConditionIsSufficientOnly) {
  // Column and row sums above 1, and yet the spectral radius of C is 0.
  const InputOutputFacts facts = AnalyzeInputOutput(Economy(Matrix{{0, 3}, {0, 0}}));
  EXPECT_TRUE(facts.column_sums.no());
  EXPECT_EQ(facts.column_sums.witness.indices, std::vector<Index>{1});
  EXPECT_TRUE(facts.condition.no());
  EXPECT_TRUE(facts.m_matrix.yes());
}

TEST(InputOutputTest, RefusesNegativeInputs) {
  EXPECT_FALSE(MakeInputOutputProblem(Economy(Matrix{{0, -0.1}, {0, 0}})).ok());
}

}  // namespace
}  // namespace dlcs
