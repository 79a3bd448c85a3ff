// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/least_norm.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

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
using testing::SemidefiniteProblem;
using testing::SizeOfSums;
using testing::SolveCold;

Selector NormOf(Index n) { return {Matrix::Identity(n, n), Vector::Zero(n)}; }

// The one that the problem was made from, the nearest to a random point, and all basic ones where they are cheap: for
// n = 7 and M of rank one they cost 128 quadratic programs.
std::vector<Vector> SomeSolutions(LcpGenerator& generator, const SemidefiniteProblem& problem) {
  const auto& [M, q, known] = problem;
  const Index n = q.size();
  std::vector<Vector> solutions = {known};
  const Selector near_random{Matrix::Identity(n, n), 3 * generator.GaussianVector(n)};
  solutions.push_back(FindNearestPoint(ConvexSolutionSet(M, q, known), near_random).v);
  if (n > 4) return solutions;
  for (const BasicSolution& basic : AllBasicSolutions(M, q).solutions) solutions.push_back(basic.y);
  return solutions;
}

// Against the quadratic program over the whole solution set, and the program's own proof: y*ᵀ(v - y*) >= 0 for all
// solutions v.
TEST(LeastNormTest, AgreesWithTheQuadraticProgramAndNoSolutionIsShorter) {
  LcpGenerator generator(1);
  int several = 0, by_regularization = 0, by_program = 0;
  for (int round = 0; round < 600; ++round) {
    const SemidefiniteProblem problem = DrawSemidefinite(generator, round);
    const auto& [M, q, known] = problem;
    SCOPED_TRACE(::testing::Message() << "M =\n" << M << "\nq = " << q.transpose());
    LeastNormSolver solver(M);
    const LcpOutcome least = SolveCold(solver, q);
    ASSERT_EQ(least.verdict, LcpStatus::kSolved);
    const double size = SizeOfSums(M, q, least.y);
    EXPECT_LE(LcpResidual(M, q, least.y), 1e-9 * size) << least.method;
    const NearestPoint nearest = FindNearestPoint(ConvexSolutionSet(M, q, least.y), NormOf(q.size()));
    ASSERT_EQ(nearest.answer, Feasibility::kFeasible);
    EXPECT_LE((nearest.v - least.y).norm(), 1e-6 * (1 + least.y.norm())) << least.method;
    double farthest = 0;
    for (const Vector& other : SomeSolutions(generator, problem)) {
      EXPECT_LE(LcpResidual(M, q, other), 1e-7 * SizeOfSums(M, q, other));
      EXPECT_GE(least.y.dot(other - least.y), -1e-8 * (1 + least.y.squaredNorm() + other.squaredNorm()));
      farthest = std::max(farthest, (other - least.y).norm());
    }
    several += farthest > 1e-3;
    by_regularization += least.method == "regularization (least norm)";
    by_program += least.method == "quadratic programming (least norm)";
  }
  EXPECT_GT(several, 200);
  EXPECT_GT(by_regularization, 200);
  RecordProperty("several", several);
  RecordProperty("by_regularization", by_regularization);
  RecordProperty("by_quadratic_program", by_program);
}

TEST(LeastNormTest, SolvesWhatCanBeSeenByEye) {
  const auto solve = [](const Matrix& M, const Vector& q) {
    const auto result = SolveLcp(M, q, SolutionRule::kLeastNorm);
    EXPECT_TRUE(result.ok()) << result.status();
    return *result;
  };
  EXPECT_LE((solve(Matrix::Ones(2, 2), Vector{{-1.0, -1}}).y - Vector{{0.5, 0.5}}).norm(), 1e-14);
  EXPECT_LE((solve(Matrix::Ones(3, 3), Vector{{-1.0, -1, 5}}).y - Vector{{0.5, 0.5, 0}}).norm(), 1e-14);
  // y1 in [0, 1] for q = (0, 1): the least is zero, although y1 = 1 for every q1 < 0 (Remark 2.1).
  EXPECT_EQ(solve(Matrix{{0, 1}, {-1, 0}}, Vector{{0.0, 1}}).y.norm(), 0);
  EXPECT_LE((solve(Matrix{{0, 1}, {-1, 0}}, Vector{{-1e-6, 1}}).y - Vector{{1.0, 1e-6}}).norm(), 1e-14);
  EXPECT_EQ(solve(Matrix::Ones(2, 2) - 2 * Matrix::Identity(2, 2), Vector{{1.0, 1}}).y.norm(), 0);
}

TEST(LeastNormTest, FindsThatThereIsNone) {
  LeastNormSolver solver(Matrix::Zero(2, 2));
  EXPECT_EQ(SolveCold(solver, Vector{{-1.0, 1}}).verdict, LcpStatus::kInfeasible);
  EXPECT_EQ(SolveCold(solver, Vector{{std::nan(""), 1}}).verdict, LcpStatus::kNonFinite);
}

TEST(LeastNormTest, DoesNotDependOnTheGuess) {
  LcpGenerator generator(2);
  for (int round = 0; round < 100; ++round) {
    const auto [M, q, known] = DrawSemidefinite(generator, round % 3);
    LeastNormSolver solver(M);
    const LcpOutcome cold = SolveCold(solver, q);
    Basis guess(q.size());
    for (auto& entry : guess) entry = generator.Integer(0, 1) == 1;
    Vector y(q.size());
    ASSERT_EQ(solver.Solve(q, Vector::Zero(q.size()), guess, y), cold.verdict);
    EXPECT_LE((y - cold.y).norm(), 1e-7 * (1 + y.norm()));
  }
}

TEST(LeastNormTest, ServesLargeProblems) {
  LcpGenerator generator(3);
  const Matrix M = generator.PositiveSemidefinite(60, 25);
  const Vector q = generator.SolvableQ(M, true);
  const auto result = SolveLcp(M, q, SolutionRule::kLeastNorm);
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->verdict, LcpStatus::kSolved) << result->message;
  EXPECT_LE(result->residual, 1e-9 * SizeOfSums(M, q, result->y));
}

}  // namespace
}  // namespace dlcs
