// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/minimizer.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/lcp/basis/solution_function.h"
#include "core/lcp/dense/basic_solutions.h"
#include "core/lcp/dense/nearest_point.h"
#include "core/lcp/lcp.h"
#include "tests/support/lcp_outcome.h"
#include "tests/support/lcp_problems.h"
#include "tests/support/semidefinite_problems.h"

namespace dlcs {
namespace {

using testing::DrawSemidefinite;
using testing::LcpGenerator;
using testing::LcpOutcome;
using testing::SolveCold;

// Example 2.1 of [Chen & Xiang]: C = diag(0, 1), b = 0 gives (max(-q1, 0), 0), with Lipschitz constant 1.
TEST(MinimizerTest, GivesThePrintedSolutionFunctionOfExample21) {
  const Matrix M{{1, 1}, {0, -1}};
  LcpRequest request{.rule = SolutionRule::kMinimizer};
  request.selector = Selector{Matrix{{0, 0}, {0, 1}}, Vector::Zero(2)};
  LcpGenerator generator(4);
  Vector last_q = Vector::Zero(2), last_y = Vector::Zero(2);
  double steepest = 0;
  for (int round = 0; round < 400; ++round) {
    const Vector q{{generator.Uniform(-3, 3), generator.Uniform(0, 3)}};
    const auto result = SolveLcp(M, q, request);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_LE((result->y - Vector{{std::max(-q[0], 0.0), 0}}).norm(), 1e-14);
    EXPECT_TRUE(result->only_choice);
    const double change = (result->y - last_y).lpNorm<Eigen::Infinity>();
    steepest = std::max(steepest, change / (q - last_q).lpNorm<Eigen::Infinity>());
    last_q = q;
    last_y = result->y;
  }
  EXPECT_LE(steepest, 1 + 1e-12);
  EXPECT_GT(steepest, 0.9);
  EXPECT_EQ(SolveLcp(M, Vector{{1.0, -1}}, request)->verdict, LcpStatus::kInfeasible);
}

// Its derivative is diag(-1, 0) for q1 < 0 and zero for q1 > 0 (q2 > 0): at q1 = 0 the ends of the printed ∂y(q).
TEST(MinimizerTest, HasThePrintedJacobiansInExample21) {
  const Matrix M{{1, 1}, {0, -1}};
  LcpRequest request{.rule = SolutionRule::kMinimizer};
  request.selector = Selector{Matrix{{0, 0}, {0, 1}}, Vector::Zero(2)};
  const auto at = [&](double q1, double q2) { return *SolveLcp(M, Vector{{q1, q2}}, request); };
  EXPECT_TRUE(TestDifferentiable(M, at(-1, 2).sets).yes());
  EXPECT_EQ(*ClarkeElement(M, at(-1, 2).sets.J), (Matrix{{-1, 0}, {0, 0}}));
  EXPECT_TRUE(TestDifferentiable(M, at(1, 2).sets).yes());
  EXPECT_EQ(*ClarkeElement(M, at(1, 2).sets.J), Matrix::Zero(2, 2));
  const LcpResult kink = at(0, 2);
  EXPECT_TRUE(TestDifferentiable(M, kink.sets).no());
  EXPECT_EQ(kink.sets.K, std::vector<Index>{0});
  // I - D + D M: nonsingular where D is zero or one, not for D_22 = 1/2.
  const auto determinant = [&](double d1, double d2) {
    const Matrix D = Vector{{d1, d2}}.asDiagonal();
    return (Matrix::Identity(2, 2) - D + D * M).determinant();
  };
  for (const double d1 : {0.0, 1.0}) {
    for (const double d2 : {0.0, 1.0}) EXPECT_EQ(std::abs(determinant(d1, d2)), 1);
  }
  EXPECT_EQ(determinant(1, 0.5), 0);
}

// "Similar arguments": one selector each makes the other two matrices of Example 2.1 Lipschitz, with constant 1.
TEST(MinimizerTest, MakesTheOtherMatricesOfExample21Lipschitz) {
  const Matrix N{{-1, 1}, {0, 1}}, NP{{-1, 1}, {0, -1}};
  LcpRequest of_N{.rule = SolutionRule::kMinimizer}, of_NP = of_N;
  of_N.selector = Selector{Matrix{{1, 0}, {0, 0}}, Vector::Zero(2)};
  of_NP.selector = Selector{Matrix::Identity(2, 2), Vector{{0.0, 100}}};  // far up: y2 = q2, not 0
  LcpGenerator generator(10);
  int solvable = 0;
  for (int round = 0; round < 300; ++round) {
    const Vector q{{generator.Uniform(-3, 3), generator.Uniform(-3, 3)}};
    const double y2 = std::max(-q[1], 0.0);
    const auto first = SolveLcp(N, q, of_N);
    ASSERT_TRUE(first.ok());
    EXPECT_EQ(first->verdict == LcpStatus::kSolved, q[0] + y2 >= 0);
    if (first->verdict == LcpStatus::kSolved) {
      EXPECT_LE((first->y - Vector{{0.0, y2}}).norm(), 1e-14);
    }
    const auto second = SolveLcp(NP, q, of_NP);
    ASSERT_TRUE(second.ok());
    EXPECT_EQ(second->verdict == LcpStatus::kSolved, q[1] >= 0 && q[0] + q[1] >= 0);
    if (second->verdict == LcpStatus::kSolved) {
      EXPECT_LE((second->y - Vector{{0.0, q[1]}}).norm(), 1e-14);
      ++solvable;
    }
  }
  EXPECT_GT(solvable, 50);
}

// C = I, b = 0 on the same matrix: a tie where q2 = -q1, as the paper says of the least norm; not everywhere in q1 < 0.
TEST(MinimizerTest, ReportsTheTieOfTheLeastNormInExample21) {
  const Matrix M{{1, 1}, {0, -1}};
  const auto tie = SolveLcp(M, Vector{{-1.0, 1}}, SolutionRule::kLeastNorm);
  ASSERT_TRUE(tie.ok());
  EXPECT_NEAR(tie->y.norm(), 1, 1e-14);
  EXPECT_FALSE(tie->only_choice);
  const auto below = SolveLcp(M, Vector{{-1.0, 0.9}}, SolutionRule::kLeastNorm);
  EXPECT_TRUE(below->only_choice);
  EXPECT_LE((below->y - Vector{{0.1, 0.9}}).norm(), 1e-14);
  const auto above = SolveLcp(M, Vector{{-1.0, 1.1}}, SolutionRule::kLeastNorm);
  EXPECT_TRUE(above->only_choice);
  EXPECT_LE((above->y - Vector{{1.0, 0}}).norm(), 1e-14);  // a jump: this selection is not Lipschitz
}

TEST(MinimizerTest, SaysWhenAContinuumTies) {
  // All (y1, 1 - y1) solve; C looks at nothing that tells them apart.
  LcpRequest request{.rule = SolutionRule::kMinimizer};
  request.selector = Selector{Matrix::Ones(1, 2), Vector::Zero(1)};
  const auto tie = SolveLcp(Matrix::Ones(2, 2), Vector{{-1.0, -1}}, request);
  ASSERT_TRUE(tie.ok());
  EXPECT_FALSE(tie->only_choice);
  EXPECT_LE((tie->y - Vector{{0.5, 0.5}}).norm(), 1e-12);
  request.selector = Selector{Matrix{{2, 1}}, Vector::Zero(1)};
  const auto corner = SolveLcp(Matrix::Ones(2, 2), Vector{{-1.0, -1}}, request);
  EXPECT_TRUE(corner->only_choice);
  EXPECT_LE((corner->y - Vector{{0.0, 1}}).norm(), 1e-12);
}

// Two ways to the same minimizer: the convex set, and the union of its 2ⁿ pieces.
TEST(MinimizerTest, FindsTheSameOverTheConvexSetAndOverItsPieces) {
  LcpGenerator generator(5);
  for (int round = 0; round < 150; ++round) {
    const auto [M, q, known] = DrawSemidefinite(generator, round % 3);
    const Index n = q.size();
    Selector selector{.C = generator.Gaussian(generator.Integer(1, n), n), .b = {}};
    selector.b = generator.GaussianVector(selector.C.rows());
    MinimizerSolver convex(M, selector);
    const LcpOutcome over_set = SolveCold(convex, q);
    ASSERT_EQ(over_set.verdict, LcpStatus::kSolved);
    double best = std::numeric_limits<double>::infinity();
    const BasicSolutions all = AllBasicSolutions(M, q);
    for (const BasicSolution& s : all.solutions) best = std::min(best, (selector.C * s.y - selector.b).norm());
    for (const SolutionFace& face : all.faces) {
      const NearestPoint nearest =
          FindNearestPoint(SolutionFaceOf(M, q, face.basis), {selector.C(Eigen::all, face.basis), selector.b});
      if (nearest.answer == Feasibility::kFeasible) best = std::min(best, nearest.distance);
    }
    const double distance = (selector.C * over_set.y - selector.b).norm();
    EXPECT_NEAR(distance, best, 1e-7 * (1 + best)) << "M =\n" << M << "\nq = " << q.transpose();
  }
}

}  // namespace
}  // namespace dlcs
