// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/least_element.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <optional>

#include "core/lcp/lcp.h"
#include "tests/support/lcp_linear_program.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using testing::LcpGenerator;

Basis BasisOf(unsigned subset, Index n) {
  Basis basis(n);
  for (Index i = 0; i < n; ++i) basis[i] = subset >> i & 1u;
  return basis;
}

// Every guess of the basis, right or wrong, gives the least element.
void ExpectLeastFromEveryGuess(const Matrix& M, const Vector& q, const Vector& least) {
  LeastElementSolver solver(M);
  for (unsigned subset = 0; subset < (1u << q.size()); ++subset) {
    Basis basis = BasisOf(subset, q.size());
    Vector y(q.size());
    ASSERT_EQ(solver.Solve(q, Vector::Constant(q.size(), 1e-14), basis, y), LcpStatus::kSolved);
    EXPECT_LE((y - least).lpNorm<Eigen::Infinity>(), 1e-9 * (1 + least.maxCoeff())) << "guess " << subset;
    for (Index i = 0; i < q.size(); ++i) EXPECT_TRUE(basis[i] || y[i] == 0);
  }
}

TEST(LeastElementSolverTest, IgnoresTheOtherSolutionsOfExample41) {
  // With q = (-x1, x2, x2, x1) and x1, x2 > 0 there are four solutions; the least is (x1, 0, 0, 0).
  ExpectLeastFromEveryGuess(testing::ChenXiangExample41(), Vector{{-0.7, 0.3, 0.3, 0.7}}, Vector{{0.7, 0, 0, 0}});
  ExpectLeastFromEveryGuess(testing::ChenXiangExample41(), Vector{{0.7, 0.3, 0.3, -0.7}}, Vector{{0, 0, 0, 0.7}});
  ExpectLeastFromEveryGuess(testing::ChenXiangExample41(), Vector::Zero(4), Vector::Zero(4));
}

TEST(LeastElementSolverTest, AgreesWithLinearProgrammingOnExample42) {
  LcpGenerator generator(1);
  const Matrix M = testing::WuChenExample42();
  int solved = 0;
  for (int k = 0; k < 500; ++k) {
    const Vector q = generator.GaussianVector(4).array() + 0.5;
    const std::optional<Vector> least = testing::MinimizeSumOverFeasible(M, q);
    if (!least.has_value()) continue;
    ExpectLeastFromEveryGuess(M, q, *least);
    ++solved;
  }
  EXPECT_GT(solved, 50);
}

TEST(LeastElementSolverTest, WarmStartsAreRightForAnyZMatrix) {
  LcpGenerator generator(2);
  int solved = 0;
  for (int k = 0; k < 200; ++k) {
    const Matrix M = k % 2 == 0 ? generator.ZMatrix(6) : generator.SingularMMatrix(6);
    const Vector q = generator.GaussianVector(6).array() + 0.7;
    const std::optional<Vector> least = testing::MinimizeSumOverFeasible(M, q);
    if (!least.has_value()) continue;
    ExpectLeastFromEveryGuess(M, q, *least);
    ++solved;
  }
  EXPECT_GT(solved, 40);
}

TEST(LeastElementSolverTest, NamesTheConstraintThatCannotBeMet) {
  LeastElementSolver solver(Matrix{{1, -1}, {-1, 1}});
  Basis basis(2, 0);
  Vector y(2);
  EXPECT_EQ(solver.Solve(Vector{{-2.0, 1.0}}, Vector::Constant(2, 1e-14), basis, y), LcpStatus::kInfeasible);
  EXPECT_THAT(solver.Account().message, HasSubstr("w[1]"));
  EXPECT_EQ(y, Vector::Zero(2));
  EXPECT_EQ(solver.Solve(Vector{{std::numeric_limits<double>::quiet_NaN(), 1.0}}, Vector::Constant(2, 1e-14), basis, y),
            LcpStatus::kNonFinite);
}

// λᵀq = 0 with λᵀM = 0: solvable by a hair. Rounding must not turn that into a proof that it is not.
TEST(LeastElementSolverTest, SolvesSingularProblemsOnTheBorderOfFeasibility) {
  LcpGenerator generator(3);
  for (int k = 0; k < 300; ++k) {
    const Index n = generator.Integer(2, 40);
    const Matrix M = generator.BadlyScaled(generator.SingularMMatrix(n).transpose(), k % 3);
    Vector y = generator.GaussianVector(n).cwiseAbs();
    y[generator.Integer(0, n - 1)] = 0;
    const Vector q = -M * y;  // w = 0: y plus any multiple of the kernel solves
    const double size = q.lpNorm<Eigen::Infinity>();
    const Vector tolerance = Vector::Constant(n, 1e-13 * size);
    LeastElementSolver solver(M);
    Basis basis(n, 0);
    Vector found(n);
    ASSERT_EQ(solver.Solve(q, tolerance, basis, found), LcpStatus::kSolved) << k << " " << n;
    EXPECT_LE(LcpResidual(M, q, found), 1e-11 * size);
    EXPECT_TRUE((found.array() <= y.array() + 1e-8 * (1 + y.maxCoeff())).all());
    // Clearly below it, it is infeasible.
    const Vector low = q - 1e-6 * size * Vector::Ones(n);
    EXPECT_EQ(solver.Solve(low, tolerance, basis, found), LcpStatus::kInfeasible);
  }
}

}  // namespace
}  // namespace dlcs
