// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/bounded_solver.h"

#include <gtest/gtest.h>

#include <random>

#include "core/lcp/lcp.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr ResidualScale kTolerance{.split = 0, .first = 1e-12, .second = 1e-12};

std::vector<BoundedUnknown> AllFromBelow(Index size) {
  std::vector<BoundedUnknown> bounded;
  for (Index i = 0; i < size; ++i) bounded.push_back({.index = i, .sign = 1});
  return bounded;
}

// M-matrices of some grids, every unknown bounded by 0: an LCP.
TEST(BoundedSolverTest, SolvesTheLcpOfAnMMatrix) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const double speed : {0.0, 0.7}) {
    constexpr Index kSide = 9, kSize = kSide * kSide;
    Matrix K = Matrix::Zero(kSize, kSize);
    for (Index i = 0; i < kSize; ++i) {
      K(i, i) = 4.3;
      if (i % kSide > 0) K(i, i - 1) = -1 - speed;
      if (i % kSide + 1 < kSide) K(i, i + 1) = -1 + speed;
      if (i >= kSide) K(i, i - kSide) = -1;
      if (i + kSide < kSize) K(i, i + kSide) = -1;
    }
    Workers workers(1);
    BoundedSolver solver(SparseMatrix(K.sparseView()), AllFromBelow(kSize), workers);
    for (int k = 0; k < 20; ++k) {
      const Vector b = Vector::NullaryExpr(kSize, [&] { return normal(random); });
      const Vector bounds = Vector::NullaryExpr(kSize, [&] { return 0.1 * normal(random); });
      Vector z = Vector::Zero(kSize), multipliers = Vector::Zero(kSize);
      ASSERT_EQ(solver.Solve(b, bounds, kTolerance, z, multipliers), LcpStatus::kSolved);
      const auto expected = SolveLcp(K, K * bounds - b, SolutionRule::kUnique);
      ASSERT_TRUE(expected.ok());
      EXPECT_LE(MaxAbs(z - bounds - expected->y), 1e-11);
      EXPECT_LE(MaxAbs(multipliers - expected->w), 1e-11);
      EXPECT_GE((z - bounds).minCoeff(), 0);
    }
  }
}

// An upper bound is a lower one of -z.
TEST(BoundedSolverTest, KeepsUpperBounds) {
  const SparseMatrix K = (Matrix(2, 2) << 2, -1, -1, 2).finished().sparseView();
  Workers workers(1);
  BoundedSolver solver(K, {{.index = 1, .sign = -1}}, workers);
  const Vector b = Vector::Constant(2, 3), bounds = Vector::Constant(1, 1);
  Vector z = Vector::Zero(2), multipliers = Vector::Zero(1);
  ASSERT_EQ(solver.Solve(b, bounds, kTolerance, z, multipliers), LcpStatus::kSolved);
  EXPECT_LE(MaxAbs(z - Eigen::Vector2d(2, 1)), 1e-12);
  EXPECT_NEAR(multipliers[0], 3, 1e-12);  // 3 - (2 - 2), with the sign of an upper bound
}

// From {1} free the exact method visits {1, 2}, {2, 3}, {1, 3}, {1, 2}, ... for this P-matrix, whose solution is (1, 1,
// 1)/3: it must not run on, and must not claim anything.
TEST(BoundedSolverTest, SeesACycle) {
  const SparseMatrix K = (Matrix(3, 3) << 1, 2, 0, 0, 1, 2, 2, 0, 1).finished().sparseView();
  Workers workers(1);
  BoundedSolver solver(K, AllFromBelow(3), workers);
  const Vector b = Vector::Ones(3), bounds = Vector::Zero(3);
  Vector z = Eigen::Vector3d(1, 0, 0), multipliers = Eigen::Vector3d(0, 1, 1);
  EXPECT_EQ(solver.Solve(b, bounds, kTolerance, z, multipliers), LcpStatus::kPivotLimit);
  z.setZero();
  multipliers.setZero();
  EXPECT_EQ(solver.Solve(b, bounds, kTolerance, z, multipliers), LcpStatus::kSolved);
  EXPECT_LE(MaxAbs(z - Vector::Constant(3, 1.0 / 3)), 1e-12);
}

TEST(BoundedSolverTest, EndsWhereTheToleranceIsBelowRounding) {
  const SparseMatrix K = (Matrix(2, 2) << 3, -1, -1, 7).finished().sparseView();
  Workers workers(1);
  BoundedSolver solver(K, {{.index = 0, .sign = 1}}, workers);
  const Vector b = Eigen::Vector2d(0.1, 0.7), bounds = Vector::Zero(1);
  Vector z = Vector::Zero(2), multipliers = Vector::Zero(1);
  const ResidualScale too_small{.split = 0, .first = 1e-300, .second = 1e-300};
  const LcpStatus verdict = solver.Solve(b, bounds, too_small, z, multipliers);
  EXPECT_TRUE(verdict == LcpStatus::kSingular || K * z == b);
}

TEST(BoundedSolverTest, DoesNotClaimToSolveWhatIsSingularOrNotFinite) {
  const SparseMatrix K = (Matrix(2, 2) << 1, -1, -1, 1).finished().sparseView();
  Workers workers(1);
  BoundedSolver solver(K, {{.index = 0, .sign = 1}}, workers);
  const Vector bounds = Vector::Zero(1);
  Vector z = Vector::Ones(2), multipliers = Vector::Zero(1);
  // Both free: -Σ b = 0 would have to hold. At the bound: z_1 = 1, with multiplier -1 - 1 < 0.
  EXPECT_NE(solver.Solve(Vector::Ones(2), bounds, kTolerance, z, multipliers), LcpStatus::kSolved);
  z = Vector::Constant(2, std::nan(""));
  EXPECT_EQ(solver.Solve(Vector::Ones(2), bounds, kTolerance, z, multipliers), LcpStatus::kNonFinite);
}

}  // namespace
}  // namespace dlcs
