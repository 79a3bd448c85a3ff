// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/hidden_least_element.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <string>

#include "core/lcp/dense/basic_solutions.h"
#include "core/lcp/lcp.h"
#include "tests/support/lcp_outcome.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using testing::LcpGenerator;
using testing::LcpOutcome;
using testing::SizeOfSums;
using testing::SolveCold;

// M = Y X⁻¹ with Z-matrices X, Y and rᵀX + sᵀY > 0: diagonally dominant X makes rᵀX > 0 for r = e.
struct HiddenZ {
  Matrix X, M;
};

HiddenZ DrawHiddenZ(LcpGenerator& generator, Index n) {
  const Matrix X = generator.MMatrix(n);
  return {X, generator.ZMatrix(n) * X.inverse()};
}

// The least u: z = X u is a solution, and every feasible z' = X u' has u' >= u.
TEST(HiddenLeastElementTest, IsBelowEveryFeasiblePointInTheOrderOfTheCone) {
  LcpGenerator generator(7);
  int compared = 0;
  for (int round = 0; round < 300; ++round) {
    const Index n = generator.Integer(1, 6);
    const auto [X, M] = DrawHiddenZ(generator, n);
    Vector made;
    const Vector q = generator.SolvableQ(M, round % 2 == 0, &made);
    HiddenLeastElementSolver solver(M, X);
    const LcpOutcome least = SolveCold(solver, q);
    ASSERT_EQ(least.verdict, LcpStatus::kSolved) << "M =\n" << M << "\nq = " << q.transpose();
    EXPECT_LE(LcpResidual(M, q, least.y), 1e-9 * SizeOfSums(M, q, least.y));
    const Vector u = X.partialPivLu().solve(least.y);
    for (const BasicSolution& other : AllBasicSolutions(M, q).solutions) {
      const Vector above = X.partialPivLu().solve(other.y) - u;
      EXPECT_GE(above.minCoeff(), -1e-7 * (1 + X.inverse().norm() * (least.y.norm() + other.y.norm())));
      ++compared;
    }
    // The found basis is taken again without a linear program.
    Basis basis(n);
    for (Index i = 0; i < n; ++i) basis[i] = least.y[i] > 0;
    Vector again(n);
    EXPECT_EQ(solver.Solve(q, Vector::Zero(n), basis, again), LcpStatus::kSolved);
    EXPECT_LE((again - least.y).norm(), 1e-9 * (1 + least.y.norm()));
  }
  EXPECT_GT(compared, 350);  // there were several solutions to choose from
}

TEST(HiddenLeastElementTest, IsTheLeastElementForX) {
  LcpGenerator generator(8);
  for (int round = 0; round < 200; ++round) {
    const Index n = generator.Integer(1, 7);
    const Matrix M = generator.ZMatrix(n);
    const Vector q = generator.SolvableQ(M, round % 2 == 0);
    HiddenLeastElementSolver solver(M, Matrix::Identity(n, n));
    const auto least = SolveLcp(M, q, SolutionRule::kLeastElement);
    const LcpOutcome hidden = SolveCold(solver, q);
    ASSERT_EQ(hidden.verdict, least->verdict);
    EXPECT_LE((hidden.y - least->y).norm(), 1e-9 * (1 + least->y.norm()));
  }
}

// (4.11) leaves open which X: one M, two pairs X, Y of Z-matrices that satisfy (4.10), and two least elements.
TEST(HiddenLeastElementTest, DependsOnX) {
  const Matrix M{{-1, -2}, {1, 1}};
  const Matrix X1{{1, 0}, {-1, 1}}, X2{{0, -1}, {-1, 1}};
  EXPECT_EQ(M * X1, (Matrix{{1, -2}, {0, 1}}));
  EXPECT_EQ(M * X2, (Matrix{{2, -1}, {-1, 0}}));
  EXPECT_GT((X1.transpose() * Vector{{2.0, 1}}).minCoeff(), 0);  // rᵀX + sᵀY > 0
  EXPECT_GT((X2.transpose() * Vector{{0.0, 1.5}} + (M * X2).transpose() * Vector{{1.0, 0}}).minCoeff(), 0);
  const Vector q{{4.0, -1}};
  HiddenLeastElementSolver first(M, X1), second(M, X2);
  EXPECT_LE((SolveCold(first, q).y - Vector{{0.0, 1}}).norm(), 1e-14);
  EXPECT_LE((SolveCold(second, q).y - Vector{{4.0, 0}}).norm(), 1e-14);
  EXPECT_EQ(AllBasicSolutions(M, q).solutions.size(), 2u);
}

// The whole way: the search finds X, and the rule follows it. M is hidden Z, but neither Z nor P nor semidefinite.
TEST(HiddenLeastElementTest, IsReachedByTheRule) {
  LcpGenerator generator(9);
  int served = 0;
  for (int round = 0; round < 60; ++round) {
    const Matrix M = DrawHiddenZ(generator, generator.Integer(2, 5)).M;
    const Vector q = generator.SolvableQ(M, false);
    const MatrixClass matrix_class = Classify(M, SolutionRule::kHiddenLeastElement);
    const auto result = SolveLcp(M, q, SolutionRule::kHiddenLeastElement);
    if (!result.ok()) {
      EXPECT_FALSE(matrix_class.hidden_z.yes());
      EXPECT_THAT(std::string(result.status().message()), HasSubstr("hidden-least-element needs a hidden Z-matrix M"));
      continue;
    }
    ASSERT_EQ(result->verdict, LcpStatus::kSolved) << result->message;
    if (result->selection != Selection::kHiddenLeastElement) continue;
    ++served;
    const Matrix& X = matrix_class.hidden_z.witness.X;
    const Vector u = X.partialPivLu().solve(result->y);
    for (const BasicSolution& other : AllBasicSolutions(M, q).solutions) {
      const double size = 1 + X.inverse().norm() * (result->y.norm() + other.y.norm());
      EXPECT_GE((X.partialPivLu().solve(other.y) - u).minCoeff(), -1e-7 * size);
    }
  }
  EXPECT_GT(served, 20);
  const absl::Status refused =
      SolveLcp(Matrix{{0, 1}, {1, 0}}, Vector::Ones(2), SolutionRule::kHiddenLeastElement).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace dlcs
