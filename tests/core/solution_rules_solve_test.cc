// SPDX-License-Identifier: Apache-2.0
// Solution rules in whole solves: the schemes (1.8) and (1.9) of [Chen & Xiang 2013], Remark 3.1 of [Wu & Chen].
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>

#include "core/matrix_classes/matrix_class.h"
#include "core/problem/observer.h"
#include "core/solve.h"
#include "tests/support/lcp_problems.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Solution SolveWith(const Problem& problem, Method method, Index steps) {
  Options options;
  options.method = method;
  options.num_steps = steps;
  return testing::SolveWith(problem, options);
}

Problem Example41() {
  Problem problem = testing::ExampleFourOne();
  problem.rule = SolutionRule::kLeastElement;
  return problem;
}

double ErrorOf(const Solution& solution, const std::function<Vector(double)>& exact) {
  double error = 0;
  for (std::size_t k = 0; k < solution.times.size(); ++k) {
    error =
        std::max(error, (solution.x.col(static_cast<Index>(k)) - exact(solution.times[k])).lpNorm<Eigen::Infinity>());
  }
  return error;
}

// (1.8): implicit Euler with the least element, which is (max(x1, 0), 0, 0, max(-x1, 0)) as printed.
TEST(SolutionRulesInSolvesTest, LeastElementTimeSteppingFollowsTheClosedFormOfExample41) {
  double last = 0;
  for (const Index steps : {200, 400, 800}) {
    const Solution solution = SolveWith(Example41(), Method::kTimeStepping, steps);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_LE(solution.certificate.node_residual, 1e-12);
    for (Index k = 1; k < solution.y.cols(); ++k) {
      const double x1 = solution.x(0, k);
      EXPECT_LE((solution.y.col(k) - Vector{{std::max(x1, 0.0), 0, 0, std::max(-x1, 0.0)}}).norm(), 1e-13);
    }
    const double error = ErrorOf(solution, testing::ExampleFourOneExact);
    EXPECT_LE(error, 5.0 / static_cast<double>(steps));
    if (last > 0) {
      EXPECT_NEAR(last / error, 2, 0.1);
    }
    last = error;
  }
}

// Two equal diodes with resistance in parallel, q = x - 2 for both: y1 + y2 = max(2 - x, 0) is determined, its parts
// are not. x' = -x + y1 + y2 from 0 gives x = 1 - e^{-2t}.
Problem TwinDiodes() {
  Problem problem;
  problem.A = Matrix{{-1}};
  problem.B = Matrix{{1, 1}};
  problem.N = Matrix{{1}, {1}};
  problem.M = Matrix::Ones(2, 2);
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector{{-2.0, -2}});
  problem.x0 = Vector{{0.0}};
  problem.horizon = 1;
  problem.rule = SolutionRule::kLeastNorm;
  return problem;
}

Vector TwinDiodesAt(double t) { return Vector{{1 - std::exp(-2 * t)}}; }

// (1.9), step by step: x⁺ = (x + 2h)/(1 + 2h).
TEST(SolutionRulesInSolvesTest, LeastNormTimeSteppingSharesTheCurrent) {
  const Solution solution = SolveWith(TwinDiodes(), Method::kTimeStepping, 100);
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_THAT(solution.warnings, IsEmpty());
  double x = 0;
  const double h = 0.01;
  for (Index k = 0; k < solution.x.cols(); ++k) {
    if (k > 0) x = (x + 2 * h) / (1 + 2 * h);
    EXPECT_NEAR(solution.x(0, k), x, 1e-12);
    EXPECT_NEAR(solution.y(0, k), (2 - x) / 2, 1e-12);
    EXPECT_NEAR(solution.y(1, k), (2 - x) / 2, 1e-12);
  }
  EXPECT_LE(solution.certificate.node_residual, 1e-12);
}

// Remark 3.1: the least norm is Lipschitz along this solution, and both iterations find it to second order.
TEST(SolutionRulesInSolvesTest, IterationsServeTheLeastNormWhereItDoesNotJump) {
  for (const Method method : {Method::kLaplaceIteration, Method::kWuChenIteration}) {
    const Solution solution = SolveWith(TwinDiodes(), method, 64);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_LE(ErrorOf(solution, TwinDiodesAt), 1e-4);
    for (Index k = 0; k < solution.y.cols(); ++k) {
      EXPECT_NEAR(solution.y(0, k), (2 - solution.x(0, k)) / 2, 1e-9);
      EXPECT_NEAR(solution.y(1, k), solution.y(0, k), 1e-9);
    }
  }
}

// Ideal diodes, M = 0: with x >= 0 the least-norm element of SOL(x, 0) is zero, so (1.9) has no solution once the
// diodes must conduct (x = 0 from t = 1 on). The least norm over the coupled step does: y = (1/2, 1/2). The solution
// says so.
TEST(SolutionRulesInSolvesTest, LeastNormOfIdealDiodesIsThatOfTheCoupledStep) {
  Problem problem = TwinDiodes();
  problem.A = Matrix{{0}};
  problem.M = Matrix::Zero(2, 2);
  problem.f = TimeFunction::Constant(Vector{{-1.0}});
  problem.g = TimeFunction::Zero(2);
  problem.x0 = Vector{{1.0}};
  problem.horizon = 2;
  const Solution solution = SolveWith(problem, Method::kTimeStepping, 100);
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_NEAR(solution.x(0, 100), 0, 1e-12);
  EXPECT_LE((solution.y.col(100) - Vector{{0.5, 0.5}}).norm(), 1e-12);
  ASSERT_THAT(solution.warnings, SizeIs(1));
  EXPECT_THAT(solution.warnings[0], HasSubstr("of LCP(N x + g, M) at the new x; no such solution was found"));
}

// M = [0 1; -1 0], q = (x, 1): y = (0, 0) for x > 0 and (1, -x) for x < 0, each the only solution. x = 1/2 - t.
Problem JumpingProblem(double x0, double horizon) {
  Problem problem;
  problem.A = Matrix{{0}};
  problem.B = Matrix{{0, 0}};
  problem.N = Matrix{{1}, {0}};
  problem.M = Matrix{{0, 1}, {-1, 0}};
  problem.f = TimeFunction::Constant(Vector{{-1.0}});
  problem.g = TimeFunction::Constant(Vector{{0.0, 1}});
  problem.x0 = Vector{{x0}};
  problem.horizon = horizon;
  problem.rule = SolutionRule::kLeastNorm;
  return problem;
}

TEST(SolutionRulesInSolvesTest, IterationEndsWhereTheLeastNormJumpsAndSaysWhy) {
  const Solution jump = SolveWith(JumpingProblem(0.5, 1), Method::kLaplaceIteration, 100);
  EXPECT_EQ(jump.termination, Termination::kUnsupported);
  EXPECT_NEAR(jump.failure_time, 0.5, 0.011);
  EXPECT_THAT(jump.message, HasSubstr("no Lipschitz function of x"));
  for (const double x0 : {0.5, -0.1}) {
    const Solution smooth = SolveWith(JumpingProblem(x0, 0.4), Method::kLaplaceIteration, 50);
    EXPECT_EQ(smooth.termination, Termination::kReachedEnd) << smooth.message;
    EXPECT_LE(smooth.certificate.node_residual, 1e-12);
  }
  // Coupled steps go through.
  const Solution coupled = SolveWith(JumpingProblem(0.5, 1), Method::kTimeStepping, 100);
  EXPECT_EQ(coupled.termination, Termination::kReachedEnd) << coupled.message;
  EXPECT_NEAR(coupled.y(0, 100), 1, 1e-12);
}

// The nondegenerate M of Example 2.1 with C = diag(0, 1): y = (max(-q1, 0), 0), q = (x - 1, 1), so x' = y1 = 1 - x.
Problem Example21(SolutionRule rule) {
  Problem problem;
  problem.A = Matrix{{0}};
  problem.B = Matrix{{1, 0}};
  problem.N = Matrix{{1}, {0}};
  problem.M = Matrix{{1, 1}, {0, -1}};
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector{{-1.0, 1}});
  problem.x0 = Vector{{0.0}};
  problem.horizon = 1;
  problem.rule = rule;
  if (rule == SolutionRule::kMinimizer) problem.selector = Selector{Matrix{{0, 0}, {0, 1}}, Vector::Zero(2)};
  return problem;
}

TEST(SolutionRulesInSolvesTest, EveryMethodServesTheMinimizerOfExample21) {
  const auto exact = [](double t) { return Vector{{1 - std::exp(-t)}}; };
  for (const Method method : {Method::kLaplaceIteration, Method::kExponentialIntegrator, Method::kTimeStepping}) {
    const Solution solution = SolveWith(Example21(SolutionRule::kMinimizer), method, 200);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_THAT(solution.warnings, IsEmpty());
    EXPECT_LE(ErrorOf(solution, exact), method == Method::kLaplaceIteration ? 1e-5 : 5e-3);
    EXPECT_LE(solution.y.row(1).lpNorm<Eigen::Infinity>(), 0);
    EXPECT_LE(solution.certificate.node_residual, 1e-12);
  }
}

// The least norm of the same M jumps where q2 = -q1, here at the start.
TEST(SolutionRulesInSolvesTest, IterationRefusesTheLeastNormOfExample21AtItsTie) {
  Problem problem = Example21(SolutionRule::kLeastNorm);
  problem.g = TimeFunction::Formulas({"-0.5-t", "1"});  // q1 falls through -1 at t = 1/2
  problem.B.MutableDense().setZero();
  const Solution solution = SolveWith(problem, Method::kLaplaceIteration, 100);
  EXPECT_EQ(solution.termination, Termination::kUnsupported) << solution.message;
  EXPECT_NEAR(solution.failure_time, 0.5, 0.02);
}

// M is hidden Z, and neither Z nor P. Its LCP has the solutions (0, max(-q2, 0)) and (q1, 0), each least for some X
// (HiddenLeastElementTest.DependsOnX). q = (4, x - 1): x' = -x + y2 = 1 - 2x with the first, -x + 2 with the other.
Problem HiddenZProblem() {
  Problem problem;
  problem.A = Matrix{{-1}};
  problem.B = Matrix{{0.5, 1}};
  problem.N = Matrix{{0}, {1}};
  problem.M = Matrix{{-1, -2}, {1, 1}};
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector{{4.0, -1}});
  problem.x0 = Vector{{0.0}};
  problem.horizon = 1;
  problem.rule = SolutionRule::kHiddenLeastElement;
  return problem;
}

TEST(SolutionRulesInSolvesTest, EveryMethodServesTheLeastElementOfAHiddenZMatrix) {
  const Matrix X = Classify(HiddenZProblem().M, SolutionRule::kHiddenLeastElement).hidden_z.witness.X;
  const Vector apart = X.inverse() * Vector{{4.0, -1}};  // of (4, 0) above (0, 1), at t = 0
  const bool first = apart.minCoeff() >= 0;
  ASSERT_TRUE(first || apart.maxCoeff() <= 0);
  const auto exact = [&](double t) { return Vector{{first ? (1 - std::exp(-2 * t)) / 2 : 2 - 2 * std::exp(-t)}}; };
  for (const Method method : {Method::kAuto, Method::kLaplaceIteration, Method::kWuChenIteration,
                              Method::kExponentialIntegrator, Method::kTimeStepping}) {
    const Solution solution = SolveWith(HiddenZProblem(), method, 100);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_THAT(solution.warnings, IsEmpty());
    EXPECT_LE(ErrorOf(solution, exact), method == Method::kTimeStepping ? 5e-3 : 1e-4) << MethodName(solution.method);
    EXPECT_GT(solution.y.row(first ? 1 : 0).lpNorm<Eigen::Infinity>(), 0);
    EXPECT_EQ(solution.y.row(first ? 0 : 1).lpNorm<Eigen::Infinity>(), 0);
    EXPECT_LE(solution.certificate.node_residual, 1e-12 * solution.certificate.lcp_scale);
  }
}

// Theorem 3.2 beyond P- and Z-matrices: nondegenerate M with a minimizer, hidden Z, the least norm of a singular M_JJ.
TEST(SolutionRulesInSolvesTest, NewtonAndSubstitutionAgree) {
  for (const Problem& problem : {Example21(SolutionRule::kMinimizer), HiddenZProblem(), TwinDiodes()}) {
    Options options;
    options.method = Method::kTimeStepping;
    options.num_steps = 50;
    Observer silent;
    const auto substituted = Solve(problem, options, silent, {});
    options.step_solver = StepSolver::kNewton;
    const auto newton = Solve(problem, options, silent, {});
    ASSERT_TRUE(substituted.ok() && newton.ok());
    ASSERT_EQ(newton->termination, Termination::kReachedEnd) << newton->message;
    EXPECT_EQ(newton->cost.substituted_steps, 0);
    EXPECT_GE(newton->cost.newton_iterations, 50);
    EXPECT_LE((newton->x - substituted->x).lpNorm<Eigen::Infinity>(), 1e-10);
    EXPECT_LE((newton->y - substituted->y).lpNorm<Eigen::Infinity>(), 1e-10);
  }
}

// Where the least norm jumps over the step Newton's method finds no root: the step is then substituted, and counted.
// Where the pieces of the rule are not known it is refused.
TEST(SolutionRulesInSolvesTest, NewtonLeavesJumpsToSubstitutionAndRefusesUnknownPieces) {
  Options options;
  options.method = Method::kTimeStepping;
  options.num_steps = 100;
  options.step_solver = StepSolver::kNewton;
  Observer silent;
  Problem sliding = JumpingProblem(0.5, 1);
  sliding.B = Matrix{{2, 0}};  // x' = -1 + 2 y1: from t = 1/2 on x = 0 and y1 = 1/2, between the two sides of the jump
  const auto newton = Solve(sliding, options, silent, {});
  ASSERT_EQ(newton->termination, Termination::kReachedEnd) << newton->message;
  EXPECT_GE(newton->cost.substituted_steps, 49);
  EXPECT_LE(newton->certificate.node_residual, 1e-12);
  EXPECT_NEAR(newton->x(0, 100), 0, 1e-12);
  EXPECT_NEAR(newton->y(0, 100), 0.5, 1e-12);
  Problem degenerate = TwinDiodes();
  degenerate.rule = SolutionRule::kMinimizer;
  degenerate.selector = Selector{Matrix{{1, 0}}, Vector::Zero(1)};
  const auto refused = Solve(degenerate, options, silent, {});
  EXPECT_EQ(refused->termination, Termination::kUnsupported);
  EXPECT_THAT(refused->message, HasSubstr("known for nondegenerate M only"));
}

// Of w = (y2, y1) + x - 1 neither y1 nor y2 alone makes a solution, since w_i does not contain y_i. Of two equal rows
// of M with different constants not both w_i are zero.
TEST(SolutionRulesInSolvesTest, TheSparsestSolutionPassesSingularBasesOfNone) {
  for (const Matrix& M :
       {Matrix{{0, 1}, {1, 0}}, Matrix{{0, 3e5}, {1e-7, 0}}, Matrix{{1, 1, 0}, {1, 1, 0}, {0, 0, 1}}}) {
    const Index n = M.rows();
    Problem problem;
    problem.A = Matrix(-Matrix::Identity(n, n));
    problem.B = problem.N = Matrix(Matrix::Identity(n, n));
    problem.M = M;
    problem.f = TimeFunction::Zero(n);
    problem.g = TimeFunction::Constant(Vector::Constant(n, -1));
    if (n == 3) problem.g = TimeFunction::Constant(Vector{{-1.0, -2, -1}});
    problem.x0 = Vector::Zero(n);
    problem.horizon = 0.1;
    problem.rule = SolutionRule::kSparsest;
    const Solution solution = SolveWith(problem, Method::kTimeStepping, 20);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_LE(solution.certificate.node_residual, 1e-9 * solution.certificate.lcp_scale);
  }
}

TEST(SolutionRulesInSolvesTest, IterationNeedsARule) {
  Problem problem = TwinDiodes();
  problem.rule = SolutionRule::kAuto;
  const Solution solution = SolveWith(problem, Method::kLaplaceIteration, 10);
  EXPECT_EQ(solution.termination, Termination::kUnsupported);
}

}  // namespace
}  // namespace dlcs
