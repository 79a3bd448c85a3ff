// SPDX-License-Identifier: Apache-2.0
#include "core/methods/sparse_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/linalg/norms.h"
#include "core/linalg/sparse_factor.h"
#include "tests/support/solving.h"
#include "tests/support/sparse_problems.h"

namespace dlcs {
namespace {

using testing::AdvectedGrid;
using testing::WithDenseMatrices;

Solution SolveBySteps(const Problem& problem, Realisation realisation, double theta, bool average, int threads = 1) {
  Options options;
  options.method = Method::kTimeStepping;
  options.realisation = realisation;
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
    const Solution sparse = SolveBySteps(problem, Realisation::kSparseStepping, theta, average);
    const Solution dense = SolveBySteps(WithDenseMatrices(problem), Realisation::kDense, theta, average);
    ASSERT_EQ(sparse.termination, Termination::kConverged) << sparse.message;
    ASSERT_EQ(dense.termination, Termination::kConverged) << dense.message;
    EXPECT_EQ(sparse.realisation.used, Realisation::kSparseStepping);
    EXPECT_EQ(sparse.realisation.factorizations, 1);
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
  const Solution one = SolveBySteps(problem, Realisation::kSparseStepping, 0, true, 1);
  const Solution two = SolveBySteps(problem, Realisation::kSparseStepping, 0, true, 2);
  EXPECT_EQ(one.x, two.x);
  EXPECT_EQ(one.y, two.y);
}

TEST(SparseStepTest, IsTakenForSparseMatricesLeftToThemselves) {
  const Problem problem = AdvectedGrid({.side = 20, .constraints = 5, .speed = 1});
  EXPECT_EQ(SolveBySteps(problem, Realisation::kAuto, 0, false).realisation.used, Realisation::kSparseStepping);
  EXPECT_EQ(SolveBySteps(WithDenseMatrices(problem), Realisation::kAuto, 0, false).realisation.used,
            Realisation::kDense);
}

// x' = x / h makes I - hA zero: no number that follows is finite, and the solve must say so.
TEST(SparseStepTest, EndsWhereTheStepIsSingular) {
  Problem problem = AdvectedGrid({.side = 3, .constraints = 2, .speed = 0});
  SparseMatrix A(9, 9);
  A.setIdentity();
  problem.horizon = 1;
  problem.A = StructuredMatrix(SparseMatrix(60 * A));
  EXPECT_EQ(SolveBySteps(problem, Realisation::kSparseStepping, 0, false).termination, Termination::kNonFinite);
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
