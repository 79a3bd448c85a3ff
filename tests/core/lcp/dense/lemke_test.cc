// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/lemke.h"

#include <gtest/gtest.h>

#include "core/lcp/basis/basis_point.h"
#include "core/lcp/dense/feasibility.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

constexpr double kZero = 1e-11;

TEST(LemkeTest, TakesNoPivotWhereQIsNonnegative) {
  ScaledLcp lcp(Matrix::Identity(2, 2));
  ASSERT_TRUE(lcp.Load(Vector{{0.0, 1.0}}, Vector::Zero(2)));
  Lemke lemke(2);
  Basis basis(2, 1);
  EXPECT_EQ(lemke.Run(lcp, kZero, basis), LemkeEnd::kBasis);
  EXPECT_EQ(basis, (Basis{0, 0}));
  EXPECT_EQ(lemke.pivots(), 0);
}

// [Cottle, Pang & Stone 1992], Example 4.4.7 is of this kind: cycling is possible without a rule for ties.
// Here all ratios tie at the start.
TEST(LemkeTest, BreaksTiesLexicographically) {
  const Matrix M{{1, 2, 0}, {0, 1, 2}, {2, 0, 1}};
  for (const Vector& q : {Vector{{-1.0, -1, -1}}, Vector{{-1.0, 0, 0}}, Vector{{0.0, -1, -1}}}) {
    ScaledLcp lcp(M);
    ASSERT_TRUE(lcp.Load(q, Vector::Zero(q.size())));
    Lemke lemke(3);
    Basis basis(3, 0);
    ASSERT_EQ(lemke.Run(lcp, kZero, basis), LemkeEnd::kBasis);
    BasisPoint point(lcp, Elimination::kPivoting);
    ASSERT_TRUE(point.Compute(lcp, basis));
    EXPECT_TRUE(point.solved());
  }
}

// For positive semidefinite matrices the ray is a proof that nothing is feasible.
TEST(LemkeTest, EndsInARayThatProvesInfeasibility) {
  LcpGenerator generator(1);
  int rays = 0;
  for (int k = 0; k < 300; ++k) {
    const Index n = generator.Integer(2, 30);
    const Matrix M = k % 2 == 0 ? generator.Skew(n) : generator.PositiveSemidefinite(n, (n + 1) / 2);
    ScaledLcp lcp(M);
    ASSERT_TRUE(lcp.Load(generator.GaussianVector(n), Vector::Zero(n)));
    Lemke lemke(n);
    Basis basis(n, 0);
    const LemkeEnd end = lemke.Run(lcp, kZero, basis);
    if (end == LemkeEnd::kRay) {
      ++rays;
      EXPECT_TRUE(ProvesInfeasible(lcp, lemke.ray()));
    } else {
      ASSERT_EQ(end, LemkeEnd::kBasis);
      BasisPoint point(lcp, Elimination::kPivoting);
      ASSERT_TRUE(point.Compute(lcp, basis));
      EXPECT_TRUE(point.solved());
    }
  }
  EXPECT_GT(rays, 20);
}

TEST(LemkeTest, ARayProvesNothingElsewhere) {
  // y = (0, 1) solves LCP((-1, 0), M), and Lemke's path does not find it.
  ScaledLcp lcp(Matrix{{0, 1}, {0, 0}});
  ASSERT_TRUE(lcp.Load(Vector{{-1.0, 0.0}}, Vector::Zero(2)));
  Lemke lemke(2);
  Basis basis(2, 0);
  ASSERT_EQ(lemke.Run(lcp, kZero, basis), LemkeEnd::kRay);
  EXPECT_FALSE(ProvesInfeasible(lcp, lemke.ray()));
}

TEST(FeasibilityTest, FindsAPointOrProvesThatThereIsNone) {
  // y1 + y2 >= 1, y1 <= 1/4, y2 <= 1/2: empty; with y2 <= 1 it is not.
  const Matrix C{{1, 1}, {-1, 0}, {0, -1}};
  EXPECT_EQ(FindFeasiblePoint(C, Vector{{-1.0, 0.25, 0.5}}, Vector::Zero(3), kFewUlps).answer,
            Feasibility::kInfeasible);
  const FeasiblePoint point = FindFeasiblePoint(C, Vector{{-1.0, 0.25, 1.0}}, Vector::Zero(3), kFewUlps);
  ASSERT_EQ(point.answer, Feasibility::kFeasible);
  EXPECT_GE(point.y.minCoeff(), 0);
  EXPECT_GE((C * point.y + Vector{{-1.0, 0.25, 1.0}}).minCoeff(), -1e-15);
}

}  // namespace
}  // namespace dlcs
