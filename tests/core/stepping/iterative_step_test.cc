// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/iterative_step.h"

#include <gtest/gtest.h>

#include "core/linalg/norms.h"
#include "core/models/obstacle.h"
#include "core/models/signorini.h"
#include "tests/support/solving.h"
#include "tests/support/sparse_problems.h"

namespace dlcs {
namespace {

using testing::AdvectedGrid;
using testing::SolveToEnd;
using testing::SolveWith;

// In two stages where `method` is left open and y is Lipschitz.
Options With(PropagatorKind propagator, Method method = Method::kTimeStepping, Index steps = 40) {
  Options options;
  options.method = method;
  options.propagator = propagator;
  options.num_steps = steps;
  options.estimate_error = false;
  return options;
}

Problem Wall(Index cells) {
  return *MakeSignoriniProblem({.cells = cells, .dimensions = 3, .coefficient = 0.02, .horizon = 1});
}

Problem Membrane(Index cells) {
  return *MakeObstacleProblem({.cells = cells, .dimensions = 2, .coefficient = 0.1, .load = "-4*sin(6*t)"});
}

// The two agree, and so do their certificates.
void ExpectToAgree(const Problem& problem, const Options& like) {
  Options options = like;
  options.propagator = PropagatorKind::kSparseStepping;
  const Solution direct = SolveToEnd(problem, options);
  options.propagator = PropagatorKind::kIterativeStepping;
  const Solution solution = SolveToEnd(problem, options);
  EXPECT_EQ(solution.propagator.used, PropagatorKind::kIterativeStepping);
  EXPECT_EQ(solution.method, Method::kTimeStepping);
  EXPECT_GT(solution.propagator.linear_iterations, 0);
  EXPECT_EQ(solution.propagator.factorizations, 0) << "solved directly";
  EXPECT_GT(MaxAbs(direct.y), 0.01);
  EXPECT_LE(MaxAbs(solution.x - direct.x), 1e-10 * MaxAbs(direct.x));
  EXPECT_LE(MaxAbs(solution.y - direct.y), 1e-9 * MaxAbs(direct.y));
  EXPECT_GE(solution.y.minCoeff(), 0);
  const Certificate &of_direct = direct.certificate, &certificate = solution.certificate;
  EXPECT_LE(certificate.node_residual, 1e-11 * of_direct.lcp_scale);
  EXPECT_NEAR(certificate.midpoint_residual, of_direct.midpoint_residual, 1e-9 * of_direct.lcp_scale);
  EXPECT_NEAR(certificate.ode_defect, of_direct.ode_defect, 1e-9 * of_direct.ode_scale);
  EXPECT_NEAR(certificate.drift_of_rows, of_direct.drift_of_rows, 1e-9);
}

TEST(IterativeStepTest, AgreesWithSparseFactorsOnAWall) {
  for (const Index cells : {8, 12, 16}) {
    ExpectToAgree(Wall(cells), With(PropagatorKind::kAuto));
    ExpectToAgree(Wall(cells), With(PropagatorKind::kAuto, Method::kAuto));  // two stages
  }
}

TEST(IterativeStepTest, AgreesWithSparseFactorsAboveAnObstacle) {
  for (const Index cells : {12, 24}) ExpectToAgree(Membrane(cells), With(PropagatorKind::kAuto));
}

// y acts upwards on states that are bounded from above, and nothing else differs: x and g change their signs.
TEST(IterativeStepTest, AgreesWithSparseFactorsBelowACeiling) {
  Problem problem = Membrane(12);
  const SparseMatrix identity = problem.B.Sparse();
  problem.B = StructuredMatrix(SparseMatrix(-identity));
  problem.N = StructuredMatrix(SparseMatrix(-identity));
  problem.f = TimeFunction::Constant(Vector::Zero(problem.num_states()));
  problem.x0 = -problem.x0;
  ExpectToAgree(problem, With(PropagatorKind::kAuto));
}

// N and B differ, so that nothing is symmetric.
TEST(IterativeStepTest, AgreesWithSparseFactorsWithConvection) {
  for (const double speed : {0.0, 6.0}) {
    const Problem problem = AdvectedGrid({.side = 20, .constraints = 7, .speed = speed});
    for (const double theta : {0.0, 0.5}) {
      Options options = With(PropagatorKind::kAuto);
      options.theta = theta;
      ExpectToAgree(problem, options);
    }
    ExpectToAgree(problem, With(PropagatorKind::kAuto, Method::kAuto));
    Options averaged = With(PropagatorKind::kAuto);
    averaged.average_y = true;
    ExpectToAgree(problem, averaged);
  }
}

TEST(IterativeStepTest, HasTheSameBitsForAnyNumberOfThreads) {
  Options options = With(PropagatorKind::kIterativeStepping, Method::kAuto, 10);
  options.num_threads = 1;
  const Problem problem = Wall(25);
  const Solution one = SolveToEnd(problem, options);
  options.num_threads = 2;
  const Solution two = SolveToEnd(problem, options);
  EXPECT_EQ(one.x, two.x);
  EXPECT_EQ(one.y, two.y);
}

// The set is extrapolated and refined while the iteration runs: it does not move by one cell in each solve.
TEST(IterativeStepTest, NeedsNoMoreSetsAndIterationsOnFinerGrids) {
  constexpr Index kSteps = 6;  // so long that multigrid serves all of these grids
  std::vector<Index> iterations;
  for (const Index cells : {36, 48, 60}) {
    const Solution solution =
        SolveToEnd(Wall(cells), With(PropagatorKind::kIterativeStepping, Method::kTimeStepping, kSteps));
    EXPECT_LE(solution.propagator.set_changes, 2 * kSteps);
    EXPECT_EQ(solution.propagator.factorizations, 0);
    iterations.push_back(solution.propagator.linear_iterations);
  }
  EXPECT_LE(iterations.front(), kSteps * 22);
  EXPECT_LE(iterations.back(), 1.2 * static_cast<double>(iterations.front()));
}

// With the diagonal instead of multigrid the number is bounded by the condition number that it is taken for.
TEST(IterativeStepTest, NeedsSomeTensOfIterationsWithTheDiagonal) {
  for (const Index cells : {12, 24, 36}) {
    const Solution solution = SolveToEnd(Wall(cells), With(PropagatorKind::kIterativeStepping));
    EXPECT_LE(solution.propagator.set_changes, 40);  // one a step
    EXPECT_LE(solution.propagator.linear_iterations, 40 * 50);
  }
}

// BoundedSolverTest.SeesACycle as a step: y is (1, 0, 0) at its beginning and (1, 1, 1)/3 at its end.
TEST(IterativeStepTest, TakesSparseFactorsWhereActiveSetsCycle) {
  Problem problem;
  SparseMatrix A(3, 3);
  A.setIdentity();
  problem.A = StructuredMatrix(SparseMatrix(-A));
  problem.B = StructuredMatrix(SparseMatrix(A * 1e-3));
  problem.N = StructuredMatrix(SparseMatrix(A * 1e-3));
  problem.M = StructuredMatrix(SparseMatrix((Matrix(3, 3) << 1, 2, 0, 0, 1, 2, 2, 0, 1).finished().sparseView()));
  problem.f = TimeFunction::Constant(Vector::Zero(3));
  problem.g = TimeFunction::Formulas({"-1", "1-2*t", "-t"});
  problem.x0 = Vector::Zero(3);
  problem.horizon = 1;
  const Solution solution = SolveToEnd(problem, With(PropagatorKind::kIterativeStepping, Method::kTimeStepping, 1));
  EXPECT_EQ(solution.propagator.factorizations, 1);
  EXPECT_LE(MaxAbs(solution.y.col(1) - Vector::Constant(3, 1.0 / 3)), 1e-3);
  EXPECT_LE(solution.certificate.node_residual, 1e-12);
  ASSERT_FALSE(solution.warnings.empty());
}

// States of size 1e-10, and pairs without states beside others: in the units of a symmetric system the rows of the
// pairs differ by 1e22, and the residual of all of them shows nothing of the small ones.
TEST(IterativeStepTest, SolvesPairsOfAnySizeBesideEachOther) {
  constexpr double kUnit = 1e-10;
  const Matrix coupling{{-0.1, 0.6, 0.1, 0, 0}, {-0.5, 0.4, 1.3, 0, 0}};
  Problem problem;
  problem.A = StructuredMatrix(SparseMatrix(Matrix{{-1, 0.5}, {0.3, -2}}.sparseView()));
  problem.B = StructuredMatrix(SparseMatrix((kUnit * coupling).sparseView()));
  problem.N = StructuredMatrix(SparseMatrix((1 / kUnit * coupling.transpose()).sparseView()));
  problem.M = StructuredMatrix(SparseMatrix(Matrix{
      {0.01, 1.6, -1, 0.1, 0.9},
      {-1.6, 0.01, -1.6, -1.1, 0},
      {1, 1.6, 0.01, -1, 1.2},
      {-0.1, 1.1, 1, 0.01, 0.3},
      {-0.9, 0, -1.2, -0.3, 0.01}}.sparseView()));
  problem.f = TimeFunction::Formulas({"1e-10*sin(9*t)", "1e-10*cos(7*t)"});
  problem.g = TimeFunction::Formulas(
      {"-0.2-0.4*sin(7*t)", "0.5+2.4*sin(7*t)", "0.2+4.5*sin(7*t)", "0.4-3.8*sin(5*t)", "-0.7+4.5*sin(9*t)"});
  problem.x0 = kUnit * Vector{{1, -0.5}};
  problem.horizon = 1;
  const Method steps = Method::kTimeStepping;
  const Solution direct = SolveToEnd(problem, With(PropagatorKind::kSparseStepping, steps, 20));
  const Solution solution = SolveToEnd(problem, With(PropagatorKind::kIterativeStepping, steps, 20));
  EXPECT_LE(solution.certificate.node_residual, 1e-9 * solution.certificate.lcp_scale);
  EXPECT_LE(MaxAbs(solution.x - direct.x), 1e-7 * MaxAbs(direct.x));
  EXPECT_LE(MaxAbs(solution.y - direct.y), 1e-7 * MaxAbs(direct.y));
}

// What all steps leave is small beside the error that is asked for.
TEST(IterativeStepTest, ResidualsOfAllStepsAreASmallPartOfTheTolerance) {
  Options options;
  for (const double tolerance : {1e-4, 1e-6}) {
    options.error_tolerance = tolerance;
    for (const Index steps : {512, 4096}) {
      EXPECT_LE(static_cast<double>(steps) * IterativeStep::ToleranceFor(options, steps), tolerance / 50);
    }
  }
}

TEST(IterativeStepTest, IsRefusedWhereItDoesNotServe) {
  Problem problem = Membrane(8);
  SparseMatrix N = problem.N.Sparse();
  N.coeffRef(3, 4) = 0.5;
  problem.N = StructuredMatrix(N);
  const Solution refused = SolveWith(problem, With(PropagatorKind::kIterativeStepping));
  EXPECT_EQ(refused.termination, Termination::kUnsupported);
  EXPECT_NE(refused.message.find("pair 3"), std::string::npos) << refused.message;
  problem.rule = SolutionRule::kLeastNorm;
  EXPECT_EQ(SolveWith(problem, With(PropagatorKind::kIterativeStepping)).termination, Termination::kUnsupported);
  Options iteration = With(PropagatorKind::kIterativeStepping, Method::kLaplaceIteration);
  EXPECT_EQ(SolveWith(Wall(8), iteration).termination, Termination::kUnsupported);
}

// A dense matrix of 47² × 47² pairs alone takes 39 MB.
TEST(IterativeStepTest, IsChosenWhereSparseFactorsDoNotFit) {
  Options options = With(PropagatorKind::kAuto);
  options.max_memory = 5e7;
  options.output_times = {1};
  options.output_times_only = true;
  const Solution solution = SolveToEnd(Membrane(48), options);
  EXPECT_EQ(solution.propagator.used, PropagatorKind::kIterativeStepping);
  EXPECT_NE(solution.propagator.reason.find("--max-memory"), std::string::npos) << solution.propagator.reason;
}

TEST(IterativeStepTest, IsNotChosenWhereFactorsStaySparse) {
  const Problem problem = *MakeSignoriniProblem({.cells = 64, .coefficient = 0.02, .horizon = 1});
  EXPECT_EQ(SolveToEnd(problem, With(PropagatorKind::kAuto)).propagator.used, PropagatorKind::kSparseStepping);
}

// Factors of 24³ unknowns hold five million entries; a V-cycle reads some hundred thousand.
TEST(IterativeStepTest, IsChosenWhereFactorsFill) {
  const Solution solution = SolveToEnd(Wall(25), With(PropagatorKind::kAuto, Method::kTimeStepping, 20));
  EXPECT_EQ(solution.propagator.used, PropagatorKind::kIterativeStepping);
  EXPECT_NE(solution.propagator.reason.find("predicted"), std::string::npos) << solution.propagator.reason;
  Problem problem = Wall(25);
  problem.A = problem.A.Sparse();  // no Kronecker sum
  const Solution left_open = SolveToEnd(problem, With(PropagatorKind::kAuto, Method::kAuto, 20));
  EXPECT_EQ(left_open.propagator.used, PropagatorKind::kIterativeStepping) << left_open.reason;
  EXPECT_GT(left_open.cost.lcps, 40);  // two stages
}

}  // namespace
}  // namespace dlcs
