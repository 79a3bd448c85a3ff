// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/sparse_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/linalg/norms.h"
#include "core/linalg/sparse/sparse_factor.h"
#include "tests/support/solving.h"
#include "tests/support/sparse_problems.h"

namespace dlcs {
namespace {

using testing::AdvectedGrid;
using testing::WithDenseMatrices;

Solution SolveBySteps(const Problem& problem, PropagatorKind propagator, double theta, bool average, int threads = 1) {
  Options options;
  options.method = Method::kTimeStepping;
  options.propagator = propagator;
  options.theta = theta;
  options.average_y = average;
  options.num_steps = 60;
  options.num_threads = threads;
  return testing::SolveWith(problem, options);
}

class SparseStepTest : public ::testing::TestWithParam<std::pair<double, bool>> {};

TEST_P(SparseStepTest, TakesTheStepsOfDenseMatrices) {
  const auto [theta, average] = GetParam();
  for (const double speed : {0.0, 8.0}) {
    const Problem problem = AdvectedGrid({.side = 9, .constraints = 7, .speed = speed});
    const Solution sparse = SolveBySteps(problem, PropagatorKind::kSparseStepping, theta, average);
    const Solution dense = SolveBySteps(WithDenseMatrices(problem), PropagatorKind::kDense, theta, average);
    ASSERT_EQ(sparse.termination, Termination::kReachedEnd) << sparse.message;
    ASSERT_EQ(dense.termination, Termination::kReachedEnd) << dense.message;
    EXPECT_EQ(sparse.propagator.used, PropagatorKind::kSparseStepping);
    EXPECT_EQ(sparse.propagator.factorizations, 1);
    EXPECT_GT(MaxAbs(dense.y), 0.1);
    EXPECT_LE(MaxAbs(sparse.x - dense.x), 1e-12 * MaxAbs(dense.x));
    EXPECT_LE(MaxAbs(sparse.y - dense.y), 1e-12 * MaxAbs(dense.y));
    EXPECT_LE(sparse.certificate.node_residual, 1e-12 * sparse.certificate.lcp_scale);
  }
}

INSTANTIATE_TEST_SUITE_P(Schemes, SparseStepTest,
                         ::testing::Values(std::pair(0.0, false), std::pair(0.5, false), std::pair(0.5, true)));

TEST(SparseStepTest, HasTheSameBitsForAnyNumberOfThreads) {
  const Problem problem = AdvectedGrid({.side = 12, .constraints = 11, .speed = 3});
  const Solution one = SolveBySteps(problem, PropagatorKind::kSparseStepping, 0, true, 1);
  const Solution two = SolveBySteps(problem, PropagatorKind::kSparseStepping, 0, true, 2);
  EXPECT_EQ(one.x, two.x);
  EXPECT_EQ(one.y, two.y);
}

TEST(SparseStepTest, IsTakenForSparseMatricesLeftToThemselves) {
  const Problem problem = AdvectedGrid({.side = 20, .constraints = 5, .speed = 1});
  EXPECT_EQ(SolveBySteps(problem, PropagatorKind::kAuto, 0, false).propagator.used, PropagatorKind::kSparseStepping);
  EXPECT_EQ(SolveBySteps(WithDenseMatrices(problem), PropagatorKind::kAuto, 0, false).propagator.used,
            PropagatorKind::kDense);
}

// The nodes 1/4, 1/2, 3/4, 1 by steps that were chosen and not asked for, and by dense modes to 1e-11.
Matrix StatesOf(const Problem& problem, Options options) {
  options.output_times = {0.25, 0.5, 0.75, 1};
  options.output_times_only = true;
  return testing::SolveToEnd(problem, options).x;
}

Matrix ByTwoStages(const Problem& problem, Index steps) {
  Options options;
  options.propagator = PropagatorKind::kSparseStepping;
  options.num_steps = steps;
  return StatesOf(problem, options);
}

Matrix ByAverages(const Problem& problem, Index steps) {
  Options options;
  options.method = Method::kTimeStepping;
  options.propagator = PropagatorKind::kSparseStepping;
  options.average_y = true;
  options.num_steps = steps;
  return StatesOf(problem, options);
}

Matrix ByModes(const Problem& problem) {
  Options options;
  options.method = Method::kEventDriven;
  options.error_tolerance = 1e-11;
  return StatesOf(WithDenseMatrices(problem), options);
}

TEST(TwoStageTest, IsOfSecondOrderAcrossContacts) {
  for (const double speed : {0.0, 6.0}) {
    const Problem problem = AdvectedGrid({.side = 8, .constraints = 5, .speed = speed});
    const Matrix exact = ByModes(problem);
    const double coarse = MaxAbs(ByTwoStages(problem, 40) - exact);
    const double fine = MaxAbs(ByTwoStages(problem, 320) - exact);
    EXPECT_LT(coarse, 0.1 * MaxAbs(exact));
    EXPECT_GT(std::log(coarse / fine) / std::log(8), 1.8) << coarse << " " << fine;
  }
}

// x0 = 1 beside walls at 0: components with |λ|h = 40 and more, which the trapezoidal rule turns over step by step.
TEST(TwoStageTest, DampsWhatTheTrapezoidalRuleLetsRing) {
  const Problem problem = AdvectedGrid({.side = 10, .constraints = 5, .diffusion = 1});
  const Matrix exact = ByModes(problem);
  const double two_stages = MaxAbs((ByTwoStages(problem, 20) - exact).col(0));
  const double averages = MaxAbs((ByAverages(problem, 20) - exact).col(0));
  EXPECT_LT(two_stages, 0.03 * MaxAbs(exact));
  EXPECT_GT(averages, 20 * two_stages);
}

TEST(TwoStageTest, KeepsTheNodesOnTheConstraints) {
  Options options;
  options.propagator = PropagatorKind::kSparseStepping;
  options.num_steps = 50;
  options.estimate_error = true;
  const Problem problem = AdvectedGrid({.side = 8, .constraints = 5, .speed = 2});
  const Solution solution = testing::SolveToEnd(problem, options);
  EXPECT_EQ(solution.method, Method::kTimeStepping);
  EXPECT_EQ(solution.cost.lcps, 100 + 1);  // two a step, and that of the start
  EXPECT_EQ(solution.propagator.factorizations, 1);
  EXPECT_GT(MaxAbs(solution.y), 0.1);
  EXPECT_LE(solution.certificate.node_residual, 1e-12 * solution.certificate.lcp_scale);
  const double error = MaxAbs(solution.x.rightCols(1) - ByModes(problem).rightCols(1));
  EXPECT_GT(3 * solution.accuracy.error * MaxAbs(solution.x), error);
}

// x' = x / h makes I - hA zero: no number that follows is finite, and the solve must say so.
TEST(SparseStepTest, EndsWhereTheStepIsSingular) {
  Problem problem = AdvectedGrid({.side = 3, .constraints = 2, .speed = 0});
  SparseMatrix A(9, 9);
  A.setIdentity();
  problem.horizon = 1;
  problem.A = StructuredMatrix(SparseMatrix(60 * A));
  EXPECT_EQ(SolveBySteps(problem, PropagatorKind::kSparseStepping, 0, false).termination, Termination::kNonFinite);
}

TEST(SparseFactorTest, SolvesWhereTheDiagonalIsNoPivot) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  constexpr Index m = 60;
  SparseMatrix A(m, m);
  for (Index i = 0; i < m; ++i) {
    A.coeffRef(i, (i + 1) % m) = 3 + normal(random);
    A.coeffRef(i, (7 * i + 3) % m) += normal(random);
  }
  const std::complex<double> z(1e-9, 2e-9);  // on the diagonal of zI - A
  const SparseFactor<std::complex<double>> factor(A, SparseOrder(A), z, 1);
  ASSERT_TRUE(factor.is_regular());
  EXPECT_GT(factor.bytes(), 0);
  const Eigen::MatrixXcd b = Matrix::Random(m, 3).cast<std::complex<double>>();
  const Eigen::MatrixXcd x = factor.Solve(b);
  EXPECT_LE(MaxAbs(Matrix((z * x - A * x - b).cwiseAbs())), 1e-12);
}

TEST(SparseFactorTest, KnowsSingularMatrices) {
  SparseMatrix A(4, 4);
  A.setIdentity();
  EXPECT_FALSE(SparseFactor<double>(A, SparseOrder(A), 1.0, 1.0).is_regular());
  EXPECT_TRUE(SparseFactor<double>(A, SparseOrder(A), 2.0, 1.0).is_regular());
  A.coeffRef(0, 1) = 1;  // no longer symmetric
  EXPECT_FALSE(SparseFactor<double>(A, SparseOrder(A), 1.0, 1.0).is_regular());
  EXPECT_FALSE(SparseFactor<std::complex<double>>(A, SparseOrder(A), 1.0 + 1e-17, 1.0).is_regular());
}

}  // namespace
}  // namespace dlcs
