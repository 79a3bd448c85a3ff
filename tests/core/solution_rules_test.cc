// SPDX-License-Identifier: Apache-2.0
// The rules that pick one of several solutions: least norm, minimiser, least element of a hidden Z-matrix.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/lcp/basic_solutions.h"
#include "core/lcp/hidden_least_element.h"
#include "core/lcp/least_norm.h"
#include "core/lcp/lcp.h"
#include "core/lcp/minimiser.h"
#include "core/lcp/nearest_point.h"
#include "core/lcp/solution_function.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using testing::LcpGenerator;

struct Outcome {
  LcpVerdict verdict;
  Vector y;
  std::string method;
};

Outcome SolveWith(LcpSolver& solver, const Vector& q) {
  Outcome outcome;
  Basis basis(q.size(), 0);
  outcome.y = Vector::Zero(q.size());
  outcome.verdict = solver.Solve(q, Vector::Zero(q.size()), basis, outcome.y);
  outcome.method = solver.Account().method;
  return outcome;
}

Selector NormOf(Index n) { return {Matrix::Identity(n, n), Vector::Zero(n)}; }

double SizeOf(const Matrix& M, const Vector& q, const Vector& y) { return 1 + q.norm() + M.norm() * y.norm(); }

// A positive semidefinite problem with many solutions: q in the range of M, degenerate, M of low rank.
struct SemidefiniteProblem {
  Matrix M;
  Vector q;
  Vector known;
};

SemidefiniteProblem DrawSemidefinite(LcpGenerator& generator, int round) {
  const Index n = generator.Integer(2, 7);
  SemidefiniteProblem problem;
  switch (round % 4) {
    case 0:
      problem.M = generator.Skew(n);
      break;
    case 1: {  // symmetric, of low rank: the solution set is a polytope of dimension n - rank
      const Matrix G = generator.Gaussian(n, generator.Integer(1, n - 1)).cwiseAbs();
      problem.M = G * G.transpose();
      break;
    }
    case 2:
      problem.M = generator.PositiveSemidefinite(n, generator.Integer(0, n - 1));
      break;
    default: {  // two copies of one constraint
      problem.M = generator.PositiveSemidefinite(n, n - 1);
      problem.M.row(1) = problem.M.row(0);
      problem.M.col(1) = problem.M.col(0);
      break;
    }
  }
  problem.q = generator.SolvableQ(problem.M, round % 3 == 0, &problem.known);
  if (round % 4 == 3) problem.q[1] = problem.q[0];
  return problem;
}

// Against the quadratic program over the whole solution set, and the program's own proof: y*ᵀ(v - y*) >= 0 for all
// solutions v, of which the known one and all basic ones are tried.
TEST(LeastNormTest, AgreesWithTheQuadraticProgramAndNoSolutionIsShorter) {
  LcpGenerator generator(1);
  int several = 0, by_regularization = 0, by_program = 0;
  for (int round = 0; round < 600; ++round) {
    const auto [M, q, known] = DrawSemidefinite(generator, round);
    LeastNormSolver solver(M);
    const Outcome least = SolveWith(solver, q);
    if (round % 4 == 3 && least.verdict == LcpVerdict::kInfeasible) continue;  // q[1] was changed
    ASSERT_EQ(least.verdict, LcpVerdict::kSolved) << "M =\n" << M << "\nq = " << q.transpose();
    const double size = SizeOf(M, q, least.y);
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
  EXPECT_EQ(SolveWith(solver, Vector{{-1.0, 1}}).verdict, LcpVerdict::kInfeasible);
  EXPECT_EQ(SolveWith(solver, Vector{{std::nan(""), 1}}).verdict, LcpVerdict::kNonFinite);
}

TEST(LeastNormTest, DoesNotDependOnTheGuess) {
  LcpGenerator generator(2);
  for (int round = 0; round < 100; ++round) {
    const auto [M, q, known] = DrawSemidefinite(generator, round % 3);
    LeastNormSolver solver(M);
    const Outcome cold = SolveWith(solver, q);
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
  EXPECT_LE(result->residual, 1e-9 * SizeOf(M, q, result->y));
}

// Example 2.1 of [Chen & Xiang]: C = diag(0, 1), b = 0 gives (max(-q1, 0), 0), with Lipschitz constant 1.
TEST(MinimiserTest, GivesThePrintedSolutionFunctionOfExample21) {
  const Matrix M{{1, 1}, {0, -1}};
  LcpRequest request{.rule = SolutionRule::kMinimiser};
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
  EXPECT_EQ(SolveLcp(M, Vector{{1.0, -1}}, request)->verdict, LcpVerdict::kInfeasible);
}

// Its derivative is diag(-1, 0) for q1 < 0 and zero for q1 > 0 (q2 > 0): at q1 = 0 the ends of the printed ∂y(q).
TEST(MinimiserTest, HasThePrintedJacobiansInExample21) {
  const Matrix M{{1, 1}, {0, -1}};
  LcpRequest request{.rule = SolutionRule::kMinimiser};
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
TEST(MinimiserTest, MakesTheOtherMatricesOfExample21Lipschitz) {
  const Matrix N{{-1, 1}, {0, 1}}, NP{{-1, 1}, {0, -1}};
  LcpRequest of_N{.rule = SolutionRule::kMinimiser}, of_NP = of_N;
  of_N.selector = Selector{Matrix{{1, 0}, {0, 0}}, Vector::Zero(2)};
  of_NP.selector = Selector{Matrix::Identity(2, 2), Vector{{0.0, 100}}};  // far up: y2 = q2, not 0
  LcpGenerator generator(10);
  int solvable = 0;
  for (int round = 0; round < 300; ++round) {
    const Vector q{{generator.Uniform(-3, 3), generator.Uniform(-3, 3)}};
    const double y2 = std::max(-q[1], 0.0);
    const auto first = SolveLcp(N, q, of_N);
    ASSERT_TRUE(first.ok());
    EXPECT_EQ(first->verdict == LcpVerdict::kSolved, q[0] + y2 >= 0);
    if (first->verdict == LcpVerdict::kSolved) {
      EXPECT_LE((first->y - Vector{{0.0, y2}}).norm(), 1e-14);
    }
    const auto second = SolveLcp(NP, q, of_NP);
    ASSERT_TRUE(second.ok());
    EXPECT_EQ(second->verdict == LcpVerdict::kSolved, q[1] >= 0 && q[0] + q[1] >= 0);
    if (second->verdict == LcpVerdict::kSolved) {
      EXPECT_LE((second->y - Vector{{0.0, q[1]}}).norm(), 1e-14);
      ++solvable;
    }
  }
  EXPECT_GT(solvable, 50);
}

// C = I, b = 0 on the same matrix: a tie where q2 = -q1, as the paper says of the least norm; not everywhere in q1 < 0.
TEST(MinimiserTest, ReportsTheTieOfTheLeastNormInExample21) {
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

TEST(MinimiserTest, SaysWhenAContinuumTies) {
  // All (y1, 1 - y1) solve; C looks at nothing that tells them apart.
  LcpRequest request{.rule = SolutionRule::kMinimiser};
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

// Two ways to the same minimiser: the convex set, and the union of its 2ⁿ pieces.
TEST(MinimiserTest, FindsTheSameOverTheConvexSetAndOverItsPieces) {
  LcpGenerator generator(5);
  for (int round = 0; round < 150; ++round) {
    const auto [M, q, known] = DrawSemidefinite(generator, round % 3);
    const Index n = q.size();
    Selector selector{.C = generator.Gaussian(generator.Integer(1, n), n), .b = {}};
    selector.b = generator.GaussianVector(selector.C.rows());
    MinimiserSolver convex(M, selector);
    const Outcome over_set = SolveWith(convex, q);
    ASSERT_EQ(over_set.verdict, LcpVerdict::kSolved);
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

TEST(SolutionRulesTest, RefuseWhatTheyCannotServe) {
  LcpGenerator generator(6);
  const Matrix large = generator.Gaussian(13, 13);
  EXPECT_THAT(std::string(SolveLcp(large, Vector::Ones(13), SolutionRule::kLeastNorm).status().message()),
              HasSubstr("rule: least-norm needs a positive semidefinite M, or one with n <= 12"));
  EXPECT_THAT(std::string(SolveLcp(large, Vector::Ones(13), SolutionRule::kMinimiser).status().message()),
              HasSubstr("selector: missing; the rule minimiser needs C and b"));
  LcpRequest request{.all_basic_solutions = true};
  EXPECT_THAT(std::string(SolveLcp(Matrix::Identity(17, 17), Vector::Ones(17), request).status().message()),
              HasSubstr("all_basic_solutions: n = 17; must be at most 16"));
}

TEST(SolutionRulesTest, CarryWhatTheSolutionIs) {
  LcpRequest request{.rule = SolutionRule::kLeastElement, .all_basic_solutions = true};
  const auto result = SolveLcp(testing::ChenXiangExample41(), Vector{{-1.0, 1, 1, 1}}, request);
  ASSERT_TRUE(result.ok());
  EXPECT_THAT(result->matrix_class, HasSubstr("Z-matrix"));
  EXPECT_EQ(result->selection, Selection::kLeastElement);
  EXPECT_EQ(result->sets.J, std::vector<Index>{0});
  EXPECT_EQ(result->basic_solutions->solutions.size(), 2u);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(SolveLcp(Matrix::Identity(2, 2), Vector::Ones(2), LcpRequest{}, stop.get_token()).status().code(),
            absl::StatusCode::kCancelled);
}

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
    const Outcome least = SolveWith(solver, q);
    ASSERT_EQ(least.verdict, LcpVerdict::kSolved) << "M =\n" << M << "\nq = " << q.transpose();
    EXPECT_LE(LcpResidual(M, q, least.y), 1e-9 * SizeOf(M, q, least.y));
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
    EXPECT_EQ(solver.Solve(q, Vector::Zero(n), basis, again), LcpVerdict::kSolved);
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
    const Outcome hidden = SolveWith(solver, q);
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
  EXPECT_LE((SolveWith(first, q).y - Vector{{0.0, 1}}).norm(), 1e-14);
  EXPECT_LE((SolveWith(second, q).y - Vector{{4.0, 0}}).norm(), 1e-14);
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
    ASSERT_EQ(result->verdict, LcpVerdict::kSolved) << result->message;
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
