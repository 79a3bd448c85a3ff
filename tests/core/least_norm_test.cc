// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/least_norm.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/lcp/basic_solutions.h"
#include "core/lcp/lcp.h"
#include "core/lcp/nearest_point.h"
#include "tests/support/lcp_outcome.h"
#include "tests/support/lcp_problems.h"
#include "tests/support/semidefinite_problems.h"

namespace dlcs {
namespace {

using testing::DrawSemidefinite;
using testing::LcpGenerator;
using testing::LcpOutcome;
using testing::SizeOfSums;
using testing::SolveCold;

Selector NormOf(Index n) { return {Matrix::Identity(n, n), Vector::Zero(n)}; }

// Against the quadratic program over the whole solution set, and the program's own proof: y*ᵀ(v - y*) >= 0 for all
// solutions v, of which the known one and all basic ones are tried.
TEST(LeastNormTest, AgreesWithTheQuadraticProgramAndNoSolutionIsShorter) {
  LcpGenerator generator(1);
  int several = 0, by_regularization = 0, by_program = 0;
  for (int round = 0; round < 600; ++round) {
    const auto [M, q, known] = DrawSemidefinite(generator, round);
    LeastNormSolver solver(M);
    const LcpOutcome least = SolveCold(solver, q);
    if (round % 4 == 3 && least.verdict == LcpVerdict::kInfeasible) continue;  // q[1] was changed
    ASSERT_EQ(least.verdict, LcpVerdict::kSolved) << "M =\n" << M << "\nq = " << q.transpose();
    const double size = SizeOfSums(M, q, least.y);
    EXPECT_LE(LcpResidual(M, q, least.y), 1e-9 * size) << least.method;
    const NearestPoint nearest = FindNearestPoint(ConvexSolutionSet(M, q, least.y), NormOf(q.size()));
    ASSERT_EQ(nearest.answer, Feasibility::kFeasible);
    EXPECT_LE((nearest.v - least.y).norm(), 1e-6 * (1 + least.y.norm())) << least.method << "\nM =\n"
                                                                         << M << "\nq = " << q.transpose();
    const BasicSolutions all = AllBasicSolutions(M, q);
    for (const BasicSolution& other : all.solutions) {
      EXPECT_GE(least.y.dot(other.y - least.y), -1e-8 * (1 + least.y.squaredNorm() + other.y.squaredNorm()));
    }
    several += !all.unique();
    by_regularization += least.method == "regularization (least norm)";
    by_program += least.method == "quadratic programming (least norm)";
  }
  EXPECT_GT(several, 200);
  EXPECT_GT(by_regularization, 200);
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
  EXPECT_EQ(SolveCold(solver, Vector{{-1.0, 1}}).verdict, LcpVerdict::kInfeasible);
  EXPECT_EQ(SolveCold(solver, Vector{{std::nan(""), 1}}).verdict, LcpVerdict::kNonFinite);
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
  ASSERT_EQ(result->verdict, LcpVerdict::kSolved) << result->message;
  EXPECT_LE(result->residual, 1e-9 * SizeOfSums(M, q, result->y));
}

}  // namespace
}  // namespace dlcs
