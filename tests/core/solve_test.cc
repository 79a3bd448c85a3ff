// SPDX-License-Identifier: Apache-2.0
// The promises of Solve() that no single method owns.

#include "core/solve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/context/component_errors.h"
#include "core/linalg/norms.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;

TEST(SolveTest, NamesEveryViolationInTheError) {
  Problem problem = testing::Scalar(-1, 0, 1, 1);
  problem.horizon = -1;
  problem.M(0, 0) = NAN;
  Observer silent;
  const auto solution = Solve(problem, {}, silent, {});
  ASSERT_FALSE(solution.ok());
  EXPECT_EQ(solution.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(solution.status().message()), HasSubstr("T: "));
  EXPECT_THAT(std::string(solution.status().message()), HasSubstr("M[0][0]"));
}

TEST(SolveTest, RefusesARuleThatMDoesNotAdmit) {
  Problem problem = testing::ExampleFourOne();
  problem.rule = SolutionRule::kUnique;
  Observer silent;
  const auto solution = Solve(problem, {}, silent, {});
  ASSERT_FALSE(solution.ok());
  EXPECT_THAT(std::string(solution.status().message()), HasSubstr("rule"));
}

TEST(SolveTest, RefusesSourcesWithPoles) {
  Problem problem = testing::Scalar(-1, 0, 1, 1);
  problem.f = TimeFunction::Formulas({"1/(t-0.1)"});
  Options options;
  options.num_steps = 10;
  Observer silent;
  const auto solution = Solve(problem, options, silent, {});
  ASSERT_EQ(solution.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(solution.status().message()), HasSubstr("has no finite value at t = 0.1:"));
}

TEST(SolveTest, EstimatesTheErrorOfSteps) {
  for (const Method method : {Method::kLaplaceIteration, Method::kTimeStepping}) {
    Options options;
    options.method = method;
    options.num_steps = 400;
    options.estimate_error = true;
    Observer silent;
    const auto solution = Solve(testing::ExampleFourOne(), options, silent, {});
    ASSERT_TRUE(solution.ok());
    Matrix exact(2, solution->x.cols());
    for (Index k = 0; k < exact.cols(); ++k) {
      exact.col(k) = testing::ExampleFourOneExact(solution->times[static_cast<std::size_t>(k)]);
    }
    const double relative = RelativeDifference(solution->x, exact);
    EXPECT_GT(solution->accuracy.error, relative / 3) << MethodName(method);
    EXPECT_LT(solution->accuracy.error, 30 * relative) << MethodName(method);
  }
}

TEST(SolveTest, MidpointsShowWhatACoarseGridHides) {
  Options options;
  options.method = Method::kExponentialIntegrator;
  options.num_steps = 10;
  Observer silent;
  const auto solution = Solve(testing::ExampleFourOne(), options, silent, {});
  ASSERT_TRUE(solution.ok());
  EXPECT_LT(solution->certificate.node_residual, 1e-15);
  EXPECT_GT(solution->certificate.midpoint_residual, 1e-4);
}

TEST(SolveTest, JumpsAtABreakPointWhenTheSourceDoes) {
  // A queue whose floor rises: x' = -1 + y, 0 <= y ⟂ x + g >= 0, g = 2 until t = 1, then -0.5: from x(1⁻) = 0 to 0.5.
  Problem problem = testing::Scalar(0, 0, 1, 2);
  problem.M(0, 0) = 0;
  problem.f = TimeFunction::Constant(Vector::Constant(1, -1));
  problem.g.pieces = {{0, ConstantFunction{Vector::Constant(1, 2)}}, {1, ConstantFunction{Vector::Constant(1, -0.5)}}};
  for (const Method method : {Method::kExponentialIntegrator, Method::kTimeStepping}) {
    Options options;
    options.method = method;
    options.num_steps = 100;
    Observer silent;
    const auto refused = Solve(problem, options, silent, {});
    ASSERT_TRUE(refused.ok());
    EXPECT_EQ(refused->termination, Termination::kInconsistentState) << refused->message;
    EXPECT_EQ(refused->failure_time, 1);
    EXPECT_EQ(refused->times.back(), 1);  // the trajectory up to there is kept

    options.project_initial_state = true;
    const auto jumped = Solve(problem, options, silent, {});
    ASSERT_TRUE(jumped.ok());
    ASSERT_EQ(jumped->termination, Termination::kReachedEnd) << jumped->message;
    ASSERT_EQ(jumped->jumps.size(), 1u);
    EXPECT_EQ(jumped->jumps[0].time, 1);
    EXPECT_NEAR(jumped->jumps[0].dx[0], 0.5, 1e-12);
    EXPECT_NEAR(jumped->x(0, 50), 0.5, 1e-12);   // the state after the jump
    EXPECT_NEAR(jumped->x(0, 100), 0.5, 1e-12);  // and held there by y = 1
    EXPECT_NEAR(jumped->y(0, 50), 1, 1e-9);
  }
}

TEST(SolveTest, TakesPiecewiseSourcesFromTheRightSide) {
  // x' = f, f = 1 then -2 from t = 0.35 on: exact, since the break is a node.
  Problem problem = testing::Scalar(0, 10, 0, 1);
  problem.f.pieces = {{0, ConstantFunction{Vector::Constant(1, 1)}}, {0.35, ConstantFunction{Vector::Constant(1, -2)}}};
  for (const Method method : {Method::kLaplaceIteration, Method::kExponentialIntegrator, Method::kTimeStepping}) {
    Options options;
    options.method = method;
    options.num_steps = 7;
    Observer silent;
    const auto solution = Solve(problem, options, silent, {});
    ASSERT_TRUE(solution.ok());
    ASSERT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
    EXPECT_NEAR(solution->x(0, solution->x.cols() - 1), 0.35 - 2 * 0.65, 1e-12) << MethodName(method);
  }
}

// A Z-matrix that is singular and positive semidefinite: 0 <= y ⟂ x + L y >= 0 has a solution only for x1 + x2 >= 0,
// and the state is driven there at t = ln 2 and held by y. x' = -x + y + f.
Problem SingularZ(double start) {
  Problem problem;
  problem.A = -Matrix::Identity(2, 2);
  problem.B = problem.N = Matrix::Identity(2, 2);
  problem.M.MutableDense().resize(2, 2);
  problem.M.MutableDense() << 1, -1, -1, 1;
  problem.f = TimeFunction::Constant(Vector{{-1, -1}});
  problem.g = TimeFunction::Zero(2);
  problem.x0 = Vector{{start, start}};
  problem.horizon = 2;
  return problem;
}

TEST(SolveTest, GoesOnByCoupledStepsWhereTheLeastElementEnds) {
  Options options;
  options.num_steps = 1000;
  for (const Method method : {Method::kAuto, Method::kExponentialIntegrator}) {
    options.method = method;
    Observer silent;
    const auto solution = Solve(SingularZ(1), options, silent, {});
    ASSERT_TRUE(solution.ok());
    ASSERT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
    EXPECT_EQ(solution->method, Method::kExponentialIntegrator);
    EXPECT_FALSE(solution->warnings.empty());
    // x = 2 e^{-t} - 1 until it reaches 0, then x = 0 and y = 1: no ringing of y between 0 and 2.
    for (size_t k = 0; k < solution->times.size(); ++k) {
      const double t = solution->times[k];
      EXPECT_NEAR(solution->x(0, k), std::max(0.0, 2 * std::exp(-t) - 1), 2e-3) << t;
      if (t > std::log(2) + 0.01) {
        EXPECT_NEAR(solution->y(0, k), 1, 1e-2) << t;
      }
    }
  }
}

TEST(SolveTest, JumpsFromAStateWithoutALeastElement) {
  Options options;
  options.project_initial_state = true;
  Observer silent;
  const auto solution = Solve(SingularZ(-1), options, silent, {});
  ASSERT_TRUE(solution.ok());
  ASSERT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
  ASSERT_EQ(solution->jumps.size(), 1u);
  EXPECT_NEAR(solution->jumps[0].dx[0] + solution->jumps[0].dx[1], 2, 1e-12);
}

TEST(SolveTest, EndsWhereTheLeastElementDoesWhenThatIsAskedFor) {
  Problem problem = SingularZ(1);
  problem.rule = SolutionRule::kLeastElement;
  for (const Method method : {Method::kLaplaceIteration, Method::kExponentialIntegrator}) {
    Options options;
    options.method = method;
    Observer silent;
    const auto solution = Solve(problem, options, silent, {});
    ASSERT_TRUE(solution.ok());
    EXPECT_EQ(solution->termination, Termination::kInfeasible) << solution->message;
    EXPECT_NEAR(solution->failure_time, std::log(2), 0.01);
  }
}

TEST(SolveTest, ReturnsJustTheOutputTimes) {
  Options options;
  options.output_times = {0, 0.123, 0.7};
  options.output_times_only = true;
  Observer silent;
  const auto solution = Solve(testing::ExampleFourOne(), options, silent, {});
  ASSERT_TRUE(solution.ok());
  EXPECT_THAT(solution->times, ::testing::ElementsAre(0, 0.123, 0.7));
  EXPECT_LT(MaxAbs(solution->x.col(1) - testing::ExampleFourOneExact(0.123)), 1e-5);
}

TEST(SolveTest, EveryMethodStopsAtOnceWhenAsked) {
  std::stop_source source;
  source.request_stop();
  for (const Method method :
       {Method::kLaplaceIteration, Method::kWuChenIteration, Method::kExponentialIntegrator, Method::kTimeStepping}) {
    Options options;
    options.method = method;
    Observer silent;
    const auto solution = Solve(testing::FourVariableEasy(), options, silent, source.get_token());
    ASSERT_TRUE(solution.ok());
    EXPECT_EQ(solution->termination, Termination::kCancelled) << MethodName(method);
  }
}

}  // namespace
}  // namespace dlcs
