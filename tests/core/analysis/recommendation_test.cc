// SPDX-License-Identifier: Apache-2.0
// Recommendations are followed, and must work.

#include "core/analysis/recommendation.h"

#include <gtest/gtest.h>

#include <string>

#include "core/analyze.h"
#include "core/solve.h"
#include "tests/support/cases.h"

namespace dlcs {
namespace {

using testing::Case;
using testing::CaseError;
using testing::ErrorOf;
using testing::LoadCase;
using testing::ReferenceTimes;

class RecommendationTest : public ::testing::TestWithParam<const char*> {};

TEST_P(RecommendationTest, IsFollowedAndWorks) {
  const Case the_case = LoadCase(GetParam());
  const auto analysis = Analyze(the_case.problem, Options{}, {});
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  const Recommendation& recommendation = analysis->recommendation;
  EXPECT_EQ(recommendation.refusal, "");
  EXPECT_FALSE(analysis->matrix_class.empty());
  EXPECT_FALSE(analysis->rule.empty());
  EXPECT_GE(recommendation.reasons.size(), 2u);

  Options options = recommendation.options;
  options.output_times = ReferenceTimes(the_case);
  options.output_times_only = true;
  Observer silent;
  const auto solution = Solve(the_case.problem, options, silent, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  ASSERT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
  const CaseError error = ErrorOf(the_case, solution->times, solution->x, solution->y);
  EXPECT_EQ(options.error_tolerance, Options::kDefaultErrorTolerance);
  EXPECT_LT(error.x, Options::kDefaultErrorTolerance);
  EXPECT_LT(solution->certificate.node_residual, 1e-9 * solution->certificate.lcp_scale);
  EXPECT_EQ(options.project_initial_state, !the_case.state_jumps.empty());
}

INSTANTIATE_TEST_SUITE_P(Cases, RecommendationTest,
                         ::testing::Values("abb_circuit_a", "abb_circuit_c", "american_put", "diode_bridge",
                                           "diode_bridge_cap", "formula_zoo", "friction_oscillator", "leontief_stock",
                                           "observer_lcs", "relay_sliding", "rlcd", "saturated_pd", "train_brakes",
                                           "vickrey", "wall_permeable", "z_least"),
                         [](const auto& test) { return std::string(test.param); });

TEST(RecommendationTest, SaysWhyThereIsNone) {
  for (const char* name : {"outside_infeasible", "outside_triple_integrator"}) {
    const Case the_case = LoadCase(name);
    const auto recommendation = Recommend(the_case.problem, Options{}, {});
    ASSERT_TRUE(recommendation.ok()) << recommendation.status();
    EXPECT_NE(recommendation->refusal, "") << name;
  }
}

TEST(RecommendationTest, KeepsTheStepAndTheMethodThatWereGiven) {
  const Case the_case = LoadCase("z_least");
  Options options;
  options.method = Method::kTimeStepping;
  options.num_steps = 321;
  const auto recommendation = Recommend(the_case.problem, options, {});
  ASSERT_TRUE(recommendation.ok()) << recommendation.status();
  EXPECT_EQ(recommendation->options.method, Method::kTimeStepping);
  EXPECT_EQ(recommendation->options.num_steps, 321);
  EXPECT_EQ(recommendation->options.error_tolerance, 0);
  EXPECT_GT(recommendation->predicted_error.value(), 0);
}

}  // namespace
}  // namespace dlcs
