// SPDX-License-Identifier: Apache-2.0
// w of a solution: that of its own x and y, with the limits of y.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/event_driven/interpolant.h"
#include "core/linalg/norms.h"
#include "core/models/signorini.h"
#include "core/nonlinear/solve_nonlinear.h"
#include "core/problem/observer.h"
#include "core/problem/time_function.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::ExampleFourOne;
using testing::SolveToEnd;

constexpr double kBreak = 0.375;

Options By(Method method, Index steps) {
  Options options;
  options.method = method;
  options.num_steps = steps;
  return options;
}

// Example 4.1 with a g that jumps at kBreak: both limits of w differ there, in some rows with y = 0 on either side.
Problem WithABreak() {
  Problem problem = ExampleFourOne();
  problem.g.pieces = {{0, ConstantFunction{Vector{{0, 1, 1, 0}}}}, {kBreak, ConstantFunction{Vector{{-2, 3, 3, 1}}}}};
  return problem;
}

// N x + g + M y at column k, for the limit from `side`.
Vector WOf(const Problem& problem, const Solution& solution, Index k, Side side, const Vector& y) {
  auto g = TimeFunctionEvaluator::Create(problem.g, problem.num_constraints());
  EXPECT_TRUE(g.ok());
  Vector w(problem.num_constraints());
  g->Evaluate(solution.times[static_cast<std::size_t>(k)], side, w);
  w += problem.N * Vector(solution.x.col(k)) + problem.M * y;
  return w;
}

void ExpectOwnW(const Problem& problem, const Solution& solution, double tolerance) {
  const char* method = MethodName(solution.method);
  ASSERT_EQ(solution.w.rows(), problem.num_constraints());
  ASSERT_EQ(solution.w.cols(), solution.y.cols());
  const double allowed = tolerance * (1 + MaxAbs(solution.w) + MaxAbs(solution.x));
  for (Index k = 0; k < solution.w.cols(); ++k) {
    const Side side = k + 1 < solution.w.cols() ? Side::kRight : Side::kLeft;
    const Vector w = WOf(problem, solution, k, side, solution.y.col(k));
    EXPECT_LE(MaxAbs(w - solution.w.col(k)), allowed) << method << " at " << k;
  }
  for (const LeftLimit& limit : solution.left_limits) {
    const Vector w = WOf(problem, solution, limit.column, Side::kLeft, limit.y);
    EXPECT_LE(MaxAbs(w - limit.w), allowed) << method << ", left limit at " << limit.column;
  }
}

TEST(TrajectoryWTest, IsThatOfXAndYForEveryMethod) {
  Options averaged = By(Method::kTimeStepping, 64), newton = By(Method::kTimeStepping, 64);
  averaged.average_y = true;
  newton.step_solver = StepSolver::kNewton;
  for (const Options& options :
       {By(Method::kTimeStepping, 64), averaged, newton, By(Method::kExponentialIntegrator, 64),
        By(Method::kLaplaceIteration, 64), By(Method::kWuChenIteration, 64)}) {
    ExpectOwnW(ExampleFourOne(), SolveToEnd(ExampleFourOne(), options), 1e-14);
    const Solution jumps = SolveToEnd(WithABreak(), options);
    ExpectOwnW(WithABreak(), jumps, 1e-14);
    ASSERT_EQ(jumps.left_limits.size(), 1u) << MethodName(options.method);
    EXPECT_EQ(jumps.times[static_cast<std::size_t>(jumps.left_limits[0].column)], kBreak);
  }
  ExpectOwnW(WithABreak(), SolveToEnd(WithABreak(), By(Method::kEventDriven, 64)), 1e-8);
}

TEST(TrajectoryWTest, JumpsWithGWhereYDoesNot) {
  Problem problem = testing::Scalar(0, 0, 0, 1);
  problem.g.pieces = {{0, ConstantFunction{Vector::Constant(1, 2)}}, {0.5, ConstantFunction{Vector::Constant(1, 5)}}};
  for (const Method method : {Method::kTimeStepping, Method::kExponentialIntegrator, Method::kEventDriven}) {
    const Solution solution = SolveToEnd(problem, By(method, 8));
    ASSERT_EQ(solution.left_limits.size(), 1u) << MethodName(method);
    EXPECT_EQ(solution.left_limits[0].y[0], 0);
    EXPECT_NEAR(solution.left_limits[0].w[0], 2, 1e-12);
    EXPECT_NEAR(solution.w(0, solution.left_limits[0].column), 5, 1e-12);
  }
}

TEST(TrajectoryWTest, IsComplementaryBitForBitWhereEventsAreLocated) {
  Index active = 0, inactive = 0;
  for (const Problem& problem : {testing::FourVariableEasy(), testing::FourVariableHard(), ExampleFourOne()}) {
    const Solution solution = SolveToEnd(problem, By(Method::kEventDriven, 1000));
    for (Index k = 0; k < solution.w.cols(); ++k) {
      for (Index i = 0; i < solution.w.rows(); ++i) {
        const double y = solution.y(i, k), w = solution.w(i, k);
        EXPECT_TRUE(y == 0 || w == 0) << i << " at " << solution.times[static_cast<std::size_t>(k)];
        EXPECT_GE(w, 0);
        active += y > 0;
        inactive += w > 0;
      }
    }
    ExpectOwnW(problem, solution, 1e-8);
  }
  EXPECT_GT(active, 0);
  EXPECT_GT(inactive, 0);
}

TEST(TrajectoryWTest, IsThereAtOutputTimesOfStatesThatAreNotKept) {
  const auto problem = MakeSignoriniProblem({.cells = 9, .horizon = 0.5});
  ASSERT_TRUE(problem.ok()) << problem.status();
  for (const Method method : {Method::kExponentialIntegrator, Method::kLaplaceIteration}) {
    Options options = By(method, 40);
    options.propagator = PropagatorKind::kKroneckerSum;
    options.output_times = {0, 0.125, 0.5};
    options.output_times_only = true;
    const Solution solution = SolveToEnd(*problem, options);
    ASSERT_EQ(solution.times, options.output_times);
    EXPECT_EQ(solution.propagator.used, PropagatorKind::kKroneckerSum);
    ExpectOwnW(*problem, solution, 1e-13);
    EXPECT_GT(MaxAbs(solution.w), 0);
  }
}

TEST(TrajectoryWTest, IsGOfANonlinearProblem) {
  NonlinearProblem problem;
  problem.f = {"-x1+y1"};
  problem.g = {"y1+y1**3+x1-1-t"};
  problem.x0 = Vector::Constant(1, 2);
  problem.horizon = 2;
  Options options;
  options.num_steps = 100;
  Observer silent;
  const auto solution = SolveNonlinear(problem, options, silent, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  ASSERT_EQ(solution->w.cols(), 101);
  for (Index k = 0; k < solution->w.cols(); ++k) {
    const double x = solution->x(0, k), y = solution->y(0, k), t = solution->times[static_cast<std::size_t>(k)];
    EXPECT_NEAR(solution->w(0, k), y + y * y * y + x - 1 - t, 1e-14);
    EXPECT_NEAR(std::min(y, solution->w(0, k)), 0, 1e-10);
  }
}

TEST(TrajectoryWTest, OfTheInterpolantIsThatOfItsXAndY) {
  const Problem problem = WithABreak();
  for (const Method method : {Method::kTimeStepping, Method::kExponentialIntegrator, Method::kEventDriven}) {
    Options options = By(method, 64);
    options.keep_pieces = true;
    const Solution solution = SolveToEnd(problem, options);
    auto dense = Interpolant::Create(problem, solution);
    ASSERT_TRUE(dense.ok()) << dense.status();
    for (const double time : {0.0, 0.1, kBreak, 0.7, 1.0}) {
      for (const Side side : {Side::kLeft, Side::kRight}) {
        const Interpolant::Point point = dense->Limit(time, side);
        auto g = TimeFunctionEvaluator::Create(problem.g, 4);
        ASSERT_TRUE(g.ok());
        Vector w(4);
        g->Evaluate(time, side, w);
        w += problem.N * point.x + problem.M * point.y;
        EXPECT_LE(MaxAbs(w - point.w), 1e-8) << MethodName(method) << " " << time;
      }
    }
  }
}

TEST(TrajectoryWTest, HasTheSameBitsForAnyNumberOfThreads) {
  Options one = By(Method::kLaplaceIteration, 500), four = one;
  one.num_threads = 1;
  four.num_threads = 4;
  EXPECT_EQ(SolveToEnd(ExampleFourOne(), one).w, SolveToEnd(ExampleFourOne(), four).w);
}

}  // namespace
}  // namespace dlcs
