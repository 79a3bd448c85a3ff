// SPDX-License-Identifier: Apache-2.0
// Solves that end before T, and what is refused before the first step.

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>
#include <string>

#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::ExampleFourOne;
using testing::LoadCase;
using testing::Scalar;
using testing::SolveAt;

// The least element of 0 <= y ⟂ x - y >= 0 is y = 0 for x >= 0, and there is none for x < 0; x = 1 - t.
TEST(EarlyEndsTest, EndsWhereNoLeastElementIsLeft) {
  Problem problem = Scalar(0, 0, 1, 2);
  problem.M(0, 0) = -1;
  problem.f = TimeFunction::Constant(Vector::Constant(1, -1));
  problem.B(0, 0) = 0.5;
  const Solution solution = SolveAt(problem, 1e-9);
  EXPECT_EQ(solution.termination, Termination::kInfeasible) << solution.message;
  EXPECT_NEAR(solution.failure_time, 1, 1e-8);
  EXPECT_LT(solution.times.back(), 1);
  EXPECT_GT(solution.times.back(), 0.99);
}

TEST(EarlyEndsTest, SaysWhenTheStateOverflows) {
  const Solution solution = SolveAt(Scalar(1e4, 1, 1, 10), 1e-9);
  EXPECT_EQ(solution.termination, Termination::kNonFinite) << solution.message;
  EXPECT_LT(solution.failure_time, 0.08);
}

TEST(EarlyEndsTest, DoesNotCallALargeSourceInfinite) {
  Problem problem = Scalar(-1, 1, 1, 2);
  for (const char* source : {"1.7e308*cos(9*t)", "1e307*sin(40*t)"}) {
    problem.g = TimeFunction::Formulas({source});
    const Solution large = SolveAt(problem, 1e-9);
    EXPECT_EQ(large.termination, Termination::kNonFinite) << source;
    EXPECT_TRUE(large.message.starts_with("g[0] is ")) << large.message;
    EXPECT_NE(large.message.find("overflow"), std::string::npos) << large.message;
    EXPECT_EQ(large.message.find("finite"), std::string::npos) << large.message;
  }
}

TEST(EarlyEndsTest, DoesNotCallGrowthBeyondTheRangeOfNumbersInfeasible) {
  // y = 1000 (x2 - x1) + 0.001 grows like e^{1000 t}, beyond 1.8e308 at t = 0.72.
  Problem problem;
  problem.A = Matrix::Zero(2, 2);
  problem.B = Matrix{{-1}, {0}};
  problem.N = Matrix{{1000, -1000}};
  problem.M = Matrix{{1}};
  problem.x0 = Vector::Zero(2);
  problem.f = TimeFunction::Constant(Vector::Zero(2));
  problem.g = TimeFunction::Constant(Vector{{-0.001}});
  problem.horizon = 1;
  const Solution solution = SolveAt(problem, 1e-9);
  EXPECT_EQ(solution.termination, Termination::kNonFinite) << solution.message;
  EXPECT_NEAR(solution.failure_time, 0.72, 0.01);
}

TEST(EarlyEndsTest, StopsOnRequest) {
  std::stop_source stop;
  stop.request_stop();
  Options options;
  options.method = Method::kEventDriven;
  Observer silent;
  const auto result = Solve(ExampleFourOne(), options, silent, stop.get_token());
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->termination, Termination::kCancelled);
}

TEST(EarlyEndsTest, RefusesRulesThatAModeDoesNotDetermineAndRelativeDegreeThree) {
  Problem problem = LoadCase("diode_bridge_cap").problem;
  problem.rule = SolutionRule::kLeastNorm;
  const Solution least_norm = SolveAt(problem, 1e-9);
  EXPECT_EQ(least_norm.termination, Termination::kUnsupported);
  EXPECT_NE(least_norm.message.find("least norm"), std::string::npos) << least_norm.message;
  const Solution triple = SolveAt(LoadCase("outside_triple_integrator").problem, 1e-9);
  EXPECT_EQ(triple.termination, Termination::kUnsupported);
  EXPECT_NE(triple.message.find("relative degree 3"), std::string::npos) << triple.message;
}

TEST(EarlyEndsTest, RefusesTolerancesThatDoublesCannotMeet) {
  Observer silent;
  for (const double tolerance : {-1.0, 1e-15, 1.0, std::nan("")}) {
    Options options;
    options.error_tolerance = tolerance;
    const auto result = Solve(ExampleFourOne(), options, silent, {});
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument) << tolerance;
  }
}

}  // namespace
}  // namespace dlcs
