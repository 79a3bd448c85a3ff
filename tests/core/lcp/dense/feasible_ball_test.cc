// SPDX-License-Identifier: Apache-2.0

#include "core/lcp/dense/feasible_ball.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/lcp/batch.h"

namespace dlcs {
namespace {

// Whether LCP(q, M) has a least element, by Chandrasekaran's pivoting: no linear program.
bool IsFeasible(const Vector& q, const Matrix& M) {
  Workers workers(1);
  Matrix y = Matrix::Zero(q.size(), 1);
  return LcpBatch(M, Selection::kLeastElement).Solve(q, Vector::Constant(q.size(), 1e-13), workers, {}, y).verdict ==
         LcpStatus::kSolved;
}

TEST(FeasibleBallTest, HasTheClosedFormOfScalarsAndOfTheZeroMatrix) {
  const Matrix one = Matrix::Ones(1, 1);
  EXPECT_NEAR(*LargestFeasibleBall(Vector{{3}}, -one).radius, 3, 1e-12);    // q - y >= 0 wants y = 0
  EXPECT_NEAR(*LargestFeasibleBall(Vector{{-2}}, -one).radius, -2, 1e-12);  // not feasible itself
  EXPECT_TRUE(std::isinf(*LargestFeasibleBall(Vector{{-2}}, one).radius));
  EXPECT_EQ(*LargestFeasibleBall(Vector{{4, 1.5}}, Matrix::Zero(2, 2)).radius, 1.5);
  // Row 2 lends to row 1: q1 + y = q2 - y at y = 1.
  Matrix lending(2, 2);
  lending << 0, 1, 0, -1;
  EXPECT_NEAR(*LargestFeasibleBall(Vector{{1, 3}}, lending).radius, 2, 1e-12);
}

TEST(FeasibleBallTest, IsTheEdgeOfFeasibilityForRandomZMatrices) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int finite = 0, infinite = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const Index n = 1 + trial % 5;
    Matrix M = Matrix::NullaryExpr(n, n, [&] { return -std::abs(normal(random)); });
    for (Index i = 0; i < n; ++i) M(i, i) = 2 * normal(random);
    const Vector q = Vector::NullaryExpr(n, [&] { return normal(random); });
    const FeasibleBall ball = LargestFeasibleBall(q, M);
    ASSERT_TRUE(ball.radius);
    EXPECT_GE(ball.y.minCoeff(), 0);
    if (std::isinf(*ball.radius)) {
      ++infinite;
      EXPECT_GT((M * ball.y).minCoeff(), 0);
      EXPECT_TRUE(IsFeasible(Vector::Constant(n, -10), M));
      continue;
    }
    ++finite;
    const double margin = 1e-6;
    EXPECT_TRUE(IsFeasible(q.array() - (*ball.radius - margin), M)) << M << "\n" << q.transpose();
    EXPECT_FALSE(IsFeasible(q.array() - (*ball.radius + margin), M)) << M << "\n" << q.transpose();
  }
  EXPECT_GT(finite, 50);
  EXPECT_GT(infinite, 50);
}

TEST(FeasibleBallTest, SharesTheRadiusBetweenStateAndDrift) {
  Matrix N(2, 1);
  N << 2, -4;
  EXPECT_EQ(FeasibleStateRadius(3, 1, N), 0.5);
  EXPECT_EQ(FeasibleStateRadius(3, 4, N), 0);
  EXPECT_TRUE(std::isinf(FeasibleStateRadius(3, 1, Matrix::Zero(2, 1))));
  EXPECT_TRUE(std::isinf(FeasibleStateRadius(std::numeric_limits<double>::infinity(), 1, N)));
}

}  // namespace
}  // namespace dlcs
