// SPDX-License-Identifier: Apache-2.0
#include "core/event_driven/interpolant.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/discretization/scheme.h"
#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::ExampleFourOne;
using testing::ExampleFourOneExact;
using testing::FourVariableEasy;
using testing::kNoTolerance;
using testing::Relays;
using testing::Scalar;
using testing::SolveAt;

Solution Solved(const Problem& problem, Options options) {
  options.project_initial_state = true;
  return testing::SolveToEnd(problem, options);
}

Options By(Method method, Index steps) {
  Options options;
  options.method = method;
  options.num_steps = steps;
  return options;
}

Interpolant Made(const Problem& problem, const Solution& solution) {
  auto interpolant = Interpolant::Create(problem, solution);
  EXPECT_TRUE(interpolant.ok()) << interpolant.status();
  return *std::move(interpolant);
}

// x' = -1 before t = 1/2 and 1 behind it, with y held by 0 <= y ⟂ x + M y + g >= 0.
Problem WithABreak(double M) {
  Problem problem = Scalar(-1, 0, 1, 1);
  problem.M(0, 0) = M;
  problem.f.pieces = {{0, ConstantFunction{Vector::Constant(1, -3)}}, {0.5, ConstantFunction{Vector::Constant(1, 2)}}};
  problem.g.pieces = {{0, ConstantFunction{Vector::Constant(1, 0)}}, {0.5, ConstantFunction{Vector::Constant(1, -1)}}};
  return problem;
}

// At nodes the interpolant ends where the method goes on, on either side of every node.
void ExpectMeetsTheNodes(const Problem& problem, const Options& options, double tolerance) {
  const Solution solution = Solved(problem, options);
  Interpolant interpolant = Made(problem, solution);
  const double size_x = MaxAbs(solution.x), size_y = MaxAbs(solution.y);
  for (Index k = 1; k < solution.x.cols(); ++k) {
    const double time = solution.times[k];
    Vector jump = Vector::Zero(problem.num_states());
    for (const StateJump& one : solution.jumps) {
      if (one.time == time) jump += one.dx;
    }
    const Interpolant::Point left = interpolant.Limit(time, Side::kLeft);
    ASSERT_LT(MaxAbs(left.x + jump - solution.x.col(k)), tolerance * size_x) << MethodName(solution.method) << time;
    const Interpolant::Point right = interpolant.Limit(time, Side::kRight);
    if (k + 1 < solution.x.cols()) {
      ASSERT_LT(MaxAbs(right.x - solution.x.col(k)), 1e-15 * size_x) << time;
    }
    EXPECT_EQ(interpolant.At(time).y, solution.y.col(k));
    if (solution.dense_output->y_is_linear) {
      ASSERT_LE(MaxAbs(right.y - solution.y.col(k)), 1e-15 * size_y) << time;
    }
  }
}

TEST(InterpolantTest, MeetsTheNodesOfEveryMethod) {
  const auto f41 = ExampleFourOne();
  Options averaged = By(Method::kTimeStepping, 50);
  averaged.average_y = true;
  ExpectMeetsTheNodes(f41, By(Method::kTimeStepping, 50), 1e-14);
  ExpectMeetsTheNodes(f41, averaged, 1e-14);
  ExpectMeetsTheNodes(f41, By(Method::kExponentialIntegrator, 50), 1e-13);
  ExpectMeetsTheNodes(f41, By(Method::kLaplaceIteration, 50), 1e-11);
  ExpectMeetsTheNodes(f41, By(Method::kWuChenIteration, 50), 1e-4);  // P = 25: the error of the contour
}

TEST(InterpolantTest, KeepsBothLimitsOfABreakPoint) {
  for (const double M : {1.0, 0.0}) {
    for (const Method method : {Method::kTimeStepping, Method::kExponentialIntegrator}) {
      ExpectMeetsTheNodes(WithABreak(M), By(method, 40), 1e-13);
    }
  }
  // M = 1: y = max(0, -x - g) has two limits at 1/2, and exp-PL between them is the solution x' = -1 x + y + f itself.
  const Problem problem = WithABreak(1);
  const Solution solution = Solved(problem, By(Method::kExponentialIntegrator, 40));
  ASSERT_EQ(solution.left_limits.size(), 1u);
  Interpolant interpolant = Made(problem, solution);
  const auto left = interpolant.Limit(0.5, Side::kLeft), right = interpolant.Limit(0.5, Side::kRight);
  EXPECT_NEAR(left.x[0], right.x[0], 1e-15);
  EXPECT_NEAR(left.y[0], std::max(0.0, -left.x[0]), 1e-14);
  EXPECT_NEAR(right.y[0], std::max(0.0, 1 - right.x[0]), 1e-14);
  EXPECT_GT(right.y[0] - left.y[0], 0.5);
}

TEST(InterpolantTest, StatesJumpWhereTheyJump) {
  // x' = y - 1 over a floor at -g = 0 that rises to 1 at t = 1/2.
  Problem problem = Scalar(0, 0, 0.25, 1);
  problem.M.MutableDense().setZero();
  problem.f = TimeFunction::Constant(Vector::Constant(1, -1));
  problem.g.pieces = {{0, ConstantFunction{Vector::Constant(1, 0)}}, {0.5, ConstantFunction{Vector::Constant(1, -1)}}};
  const Solution solution = Solved(problem, By(Method::kExponentialIntegrator, 64));
  ASSERT_EQ(solution.jumps.size(), 1u);
  Interpolant interpolant = Made(problem, solution);
  EXPECT_NEAR(interpolant.Limit(0.5, Side::kLeft).x[0], 0, 1e-14);
  EXPECT_NEAR(interpolant.Limit(0.5, Side::kRight).x[0], 1, 1e-14);
  EXPECT_NEAR(interpolant.At(0.5).x[0], 1, 1e-14);
  EXPECT_NEAR(interpolant.At(0.125).x[0], 0.125, 1e-14);
}

// The middle of a step is also known to the schemes, by matrices of their own.
TEST(InterpolantTest, AgreesWithTheMiddleThatTheCertificateJudges) {
  const Problem problem = FourVariableEasy();
  const Index steps = 64;
  const double h = 1.0 / 64;
  const Scheme scheme = ExponentialPiecewiseLinear(problem, h);
  const Solution solution = Solved(problem, By(Method::kExponentialIntegrator, steps));
  Interpolant interpolant = Made(problem, solution);
  auto f = TimeFunctionEvaluator::Create(problem.f, 3);
  ASSERT_TRUE(f.ok());
  Vector f_begin(3), f_end(3);
  for (Index k = 0; k < steps; ++k) {
    f->Evaluate(solution.times[k], Side::kRight, f_begin);
    f->Evaluate(solution.times[k + 1], Side::kLeft, f_end);
    const Vector middle = scheme.mid_state * solution.x.col(k) + scheme.mid_y_before * solution.y.col(k) +
                          scheme.mid_y_after * solution.y.col(k + 1) + scheme.mid_f_before * f_begin +
                          scheme.mid_f_after * f_end;
    EXPECT_LT(MaxAbs(interpolant.At(solution.times[k] + h / 2).x - middle), 1e-14);
  }
}

// Between the nodes as near the truth as at them: order two with exp-PL, one with the interpolants of Theorem 7.
TEST(InterpolantTest, KeepsTheOrderOfTheMethodBetweenNodes) {
  const Problem problem = ExampleFourOne();
  const auto error = [&](Method method, Index steps) {
    const Solution solution = Solved(problem, By(method, steps));
    Interpolant interpolant = Made(problem, solution);
    double largest = 0;
    for (int j = 0; j <= 1000; ++j) {
      const double t = j / 1000.0;
      largest = std::max(largest, MaxAbs(interpolant.At(t).x - ExampleFourOneExact(t)));
    }
    return largest;
  };
  EXPECT_NEAR(std::log2(error(Method::kExponentialIntegrator, 97) / error(Method::kExponentialIntegrator, 388)) / 2, 2,
              0.2);
  EXPECT_NEAR(std::log2(error(Method::kTimeStepping, 97) / error(Method::kTimeStepping, 388)) / 2, 1, 0.2);
}

TEST(InterpolantTest, AgreesWithEveryCaseAtItsReferenceTimes) {
  for (const char* name : {"rlcd", "saturated_pd", "relay_sliding", "diode_bridge", "friction_oscillator", "z_least"}) {
    const testing::Case the_case = testing::LoadCase(name);
    const Solution solution = Solved(the_case.problem, By(Method::kAuto, 30000));  // few references are nodes
    Interpolant interpolant = Made(the_case.problem, solution);
    const std::vector<double> times = testing::ReferenceTimes(the_case);
    Matrix x(solution.x.rows(), static_cast<Index>(times.size())), y(solution.y.rows(), x.cols());
    for (Index k = 0; k < x.cols(); ++k) {
      const Interpolant::Point point = interpolant.At(times[k]);
      x.col(k) = point.x;
      y.col(k) = point.y;
    }
    const testing::CaseError error = testing::ErrorOf(the_case, times, x, y);
    EXPECT_LT(error.x, 1e-3) << name;
    EXPECT_LT(error.By, 2e-3) << name;
  }
}

TEST(InterpolantTest, NeedsEveryNode) {
  const Problem problem = ExampleFourOne();
  Options options = By(Method::kTimeStepping, 50);
  options.output_times = {0, 0.5, 1};
  options.output_times_only = true;
  const Solution sparse = Solved(problem, options);
  EXPECT_EQ(Interpolant::Create(problem, sparse).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Interpolant::Create(problem, Solution{}).status().code(), absl::StatusCode::kInvalidArgument);
  Options splines = By(Method::kWuChenIteration, 20);
  splines.interpolation = Interpolation::kCubicSpline;
  EXPECT_FALSE(Interpolant::Create(problem, Solved(problem, splines)).ok());
  options.output_times_only = false;
  const Solution dense = Solved(problem, options);
  EXPECT_TRUE(Interpolant::Create(problem, dense).ok());
  EXPECT_FALSE(Interpolant::Create(FourVariableEasy(), dense).ok());
}

TEST(InterpolantTest, IsDenseBetweenItsNodes) {
  const Problem problem = ExampleFourOne();
  const Solution solution = SolveAt(problem, 1e-9);
  ASSERT_EQ(static_cast<Index>(solution.pieces.size()), solution.cost.steps);
  auto dense = Interpolant::Create(problem, solution);
  ASSERT_TRUE(dense.ok()) << dense.status();
  for (const double t : {0.0, 0.1003, 0.5, 0.77777, 1.0}) {
    const Interpolant::Point point = dense->At(t);
    const Vector x = ExampleFourOneExact(t);
    EXPECT_LT(MaxAbs(point.x - x), 1e-9) << t;
    EXPECT_LT(MaxAbs(point.y - Vector{{std::max(x[0], 0.0), 0, 0, std::max(-x[0], 0.0)}}), 1e-9) << t;
  }
}

// The march too: x1' = x2, x2' = -2 sgn x1 - sgn x2 is continuous, and dense output meets the nodes from both sides.
TEST(InterpolantTest, DenseOutputMeetsTheNodesOfCoupledSteps) {
  Matrix A = Matrix::Zero(2, 2);
  A(0, 1) = 1;
  const Problem problem = Relays(A, Matrix{{0, 0}, {2, 1}}, Matrix::Identity(2, 2), Vector{{1, 0}}, 10);
  const Solution solution = SolveAt(problem, kNoTolerance);
  ASSERT_GT(solution.cost.coupled_steps, 0);
  auto dense = Interpolant::Create(problem, solution);
  ASSERT_TRUE(dense.ok()) << dense.status();
  for (Index k = 1; k + 1 < solution.x.cols(); ++k) {
    for (const Side side : {Side::kLeft, Side::kRight}) {
      EXPECT_LT(MaxAbs(dense->Limit(solution.times[k], side).x - solution.x.col(k)), 1e-12) << solution.times[k];
    }
  }
}

TEST(InterpolantTest, DenseOutputNeedsThePieces) {
  Options options;
  options.method = Method::kEventDriven;
  Observer silent;
  const auto solution = Solve(ExampleFourOne(), options, silent, {});
  ASSERT_TRUE(solution.ok());
  EXPECT_TRUE(solution->pieces.empty());
  EXPECT_FALSE(Interpolant::Create(ExampleFourOne(), *solution).ok());
}

// w = g + y with g = -1 before the break point at 1 and -3 behind it: y jumps from 1 to 3.
TEST(InterpolantTest, HasBothLimitsWhereYJumps) {
  Problem problem = Scalar(0, 0, 0, 2);
  problem.B.MutableDense().setZero();
  problem.g = TimeFunction::Formulas({"-1-2*(t>=1)"});
  problem.break_points = {1};
  const Solution solution = SolveAt(problem, 1e-9);
  ASSERT_EQ(solution.left_limits.size(), 1u);
  const Index column = solution.left_limits[0].column;
  EXPECT_EQ(solution.times[column], 1);
  EXPECT_NEAR(solution.left_limits[0].y[0], 1, 1e-12);
  EXPECT_NEAR(solution.y(0, column), 3, 1e-12);
  auto dense = Interpolant::Create(problem, solution);
  ASSERT_TRUE(dense.ok()) << dense.status();
  EXPECT_NEAR(dense->Limit(1, Side::kLeft).y[0], 1, 1e-12);
  EXPECT_NEAR(dense->Limit(1, Side::kRight).y[0], 3, 1e-12);
}

}  // namespace
}  // namespace dlcs
