// SPDX-License-Identifier: Apache-2.0
// Games as LCPs, by the method of Lemke and Howson: closed forms, linear programs, enumeration, and the certificate.
#include "core/lcp/dense/bimatrix_games.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/lcp/dense/lemke_howson.h"
#include "core/lcp/lcp.h"
#include "tests/support/lcp_linear_program.h"
#include "tests/support/lcp_outcome.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;
using testing::LcpOutcome;
using testing::SolveCold;
using Known = ComplementarySolver::Known;

// The costs of two players, both m × n.
struct GameCosts {
  Matrix R, C;
};

Matrix MatrixOfGame(const GameCosts& costs) {
  const Index m = costs.R.rows(), n = costs.R.cols();
  Matrix M = Matrix::Zero(m + n, m + n);
  M.topRightCorner(m, n) = costs.R;
  M.bottomLeftCorner(n, m) = costs.C.transpose();
  return M;
}

GameCosts DrawCosts(Index m, Index n, const std::function<std::pair<double, double>()>& one) {
  GameCosts costs{Matrix(m, n), Matrix(m, n)};
  for (Index i = 0; i < m; ++i) {
    for (Index j = 0; j < n; ++j) std::tie(costs.R(i, j), costs.C(i, j)) = one();
  }
  return costs;
}

LcpOutcome SolveGame(const Matrix& M, const Vector& q) {
  ComplementarySolver solver(M, Known::kNothing);
  return SolveCold(solver, q);
}

// The promise of LcpSolver::Solve(), row by row.
void ExpectSolution(const Matrix& M, const Vector& q, const Vector& y) {
  const Vector w = q + M * y;
  const Vector size = q.cwiseAbs() + M.cwiseAbs() * y;
  for (Index i = 0; i < q.size(); ++i) {
    EXPECT_GE(y[i], 0);
    EXPECT_GE(w[i], -1e-12 * size[i]) << i;
    EXPECT_TRUE(y[i] == 0 || w[i] <= 1e-12 * size[i]) << i;
  }
}

void ExpectSolvedAsGame(const Matrix& M, const Vector& q, const std::string& what) {
  const LcpOutcome outcome = SolveGame(M, q);
  ASSERT_EQ(outcome.verdict, LcpStatus::kSolved) << what << ", n = " << q.size();
  ExpectSolution(M, q, outcome.y);
}

// Two players who prefer to meet, in different places: two pure equilibria and a mixed one. The paths of different
// strategies lead to both pure ones.
TEST(LemkeHowsonTest, StrategiesLeadToDifferentEquilibria) {
  const Matrix R{{1, 3}, {3, 2}}, C{{2, 3}, {3, 1}};
  std::set<Basis> found;
  for (Index strategy = 0; strategy < 4; ++strategy) {
    LemkeHowson method(R, C);
    method.Reset();
    ASSERT_EQ(method.Follow(strategy, 20, 1e-11), LemkeHowson::End::kBasis);
    found.insert(method.basis());
  }
  EXPECT_EQ(found, (std::set<Basis>{{1, 0, 1, 0}, {0, 1, 0, 1}}));
  // From a pure one the path of one of its strategies leads to the mixed one or to the begin.
  LemkeHowson method(R, C);
  std::set<Basis> behind;
  for (const Index next : {0, 1, 2, 3}) {
    method.Reset();
    ASSERT_EQ(method.Follow(0, 20, 1e-11), LemkeHowson::End::kBasis);
    if (method.Follow(next, 20, 1e-11) == LemkeHowson::End::kBasis) behind.insert(method.basis());
  }
  EXPECT_TRUE(behind.contains({1, 1, 1, 1}));
}

// In exact arithmetic the path of every strategy of a positive game leads to a solution, ties or not.
TEST(LemkeHowsonTest, EveryPathOfAPositiveGameEndsInASolution) {
  LcpGenerator generator(3);
  for (int k = 0; k < 200; ++k) {
    const Index m = generator.Integer(1, 9), n = generator.Integer(1, 9), most = k % 2 == 0 ? 2 : 50;
    const GameCosts costs = DrawCosts(
        m, n, [&] { return std::pair<double, double>(generator.Integer(1, most), generator.Integer(1, most)); });
    const Matrix M = MatrixOfGame(costs);
    ScaledLcp lcp(M);
    ASSERT_TRUE(lcp.Load(Vector::Constant(m + n, -1), Vector::Zero(m + n)));
    BasisPoint point(lcp, Elimination::kPivoting);
    LemkeHowson method(costs.R, costs.C);
    for (Index strategy = 0; strategy < m + n; ++strategy) {
      method.Reset();
      ASSERT_EQ(method.Follow(strategy, 10'000, 1e-11), LemkeHowson::End::kBasis);
      ASSERT_TRUE(point.Compute(lcp, method.basis()));
      EXPECT_TRUE(point.solved()) << MatrixOfGame(costs) << "\nstrategy " << strategy;
    }
  }
}

// Matching pennies with costs of 1 and 2: both players take either side with probability 1/2 and pay 3/2.
TEST(BimatrixGamesTest, MatchingPenniesInClosedForm) {
  const Matrix M = MatrixOfGame({Matrix{{1, 2}, {2, 1}}, Matrix{{2, 1}, {1, 2}}});
  const LcpOutcome outcome = SolveGame(M, Vector::Constant(4, -1));
  ASSERT_EQ(outcome.verdict, LcpStatus::kSolved);
  EXPECT_EQ(outcome.method, "Lemke-Howson");
  EXPECT_LE((outcome.y - Vector::Constant(4, 1 / 3.0)).lpNorm<Eigen::Infinity>(), 1e-15);
}

TEST(BimatrixGamesTest, SolvesRandomGamesOfAllSizes) {
  LcpGenerator generator(1);
  const std::vector<std::pair<Index, Index>> sizes = {{1, 1},   {1, 4},   {2, 2},   {3, 2},   {5, 5},    {7, 7},
                                                      {14, 14}, {20, 35}, {50, 50}, {3, 120}, {100, 100}};
  for (const auto& [m, n] : sizes) {
    const int games = m + n < 60 ? 60 : 6;
    for (int k = 0; k < games; ++k) {
      const auto solve = [&, m = m, n = n](const char* what, const std::function<std::pair<double, double>()>& one) {
        ExpectSolvedAsGame(MatrixOfGame(DrawCosts(m, n, one)), Vector::Constant(m + n, -1), what);
      };
      const auto drawn = [&](Index least, Index most) {
        return std::pair<double, double>(generator.Integer(least, most), generator.Integer(least, most));
      };
      solve("real", [&] { return std::pair(generator.Uniform(1e-3, 1), generator.Uniform(1e-3, 1)); });
      solve("integers", [&] { return drawn(1, 11); });
      solve("degenerate", [&] { return drawn(1, 2); });
      solve("all equal", [&] { return drawn(3, 3); });
      solve("opposed", [&] {
        const double cost = generator.Uniform(0, 1);
        return std::pair(1 + cost, 2.01 - cost + generator.Uniform(0, 0.05));
      });
    }
  }
}

// Rows and columns in units of their own, and indices in any order. Powers of two change no bit of the solution.
TEST(BimatrixGamesTest, UnitsAndOrderDoNotMatter) {
  LcpGenerator generator(2);
  for (int k = 0; k < 60; ++k) {
    const Index m = generator.Integer(1, 40), n = generator.Integer(1, 40), size = m + n;
    const Matrix M = MatrixOfGame(
        DrawCosts(m, n, [&] { return std::pair<double, double>(generator.Integer(1, 20), generator.Integer(1, 20)); }));
    const Vector q = Vector::Constant(size, -1);
    const LcpOutcome plain = SolveGame(M, q);
    ASSERT_EQ(plain.verdict, LcpStatus::kSolved);
    Vector rows(size), columns(size), tens(size);
    for (Index i = 0; i < size; ++i) {
      rows[i] = std::exp2(static_cast<double>(generator.Integer(-30, 30)));
      columns[i] = std::exp2(static_cast<double>(generator.Integer(-30, 30)));
      tens[i] = std::pow(10, generator.Uniform(-8, 8));
    }
    const LcpOutcome scaled = SolveGame(rows.asDiagonal() * M * columns.asDiagonal(), rows.cwiseProduct(q));
    ASSERT_EQ(scaled.verdict, LcpStatus::kSolved);
    EXPECT_EQ(columns.cwiseProduct(scaled.y), plain.y);
    const Matrix in_tens = tens.asDiagonal() * M;
    const Vector q_in_tens = tens.cwiseProduct(q);
    ExpectSolvedAsGame(in_tens, q_in_tens, "powers of ten");
    std::vector<Index> order(size);
    std::iota(order.begin(), order.end(), Index{0});
    std::shuffle(order.begin(), order.end(), generator.engine());
    ExpectSolvedAsGame(in_tens(order, order), q_in_tens(order), "another order");
  }
}

// The costs of both players have the sum 12. The least that the second player can make the first pay at best is V:
// Σ y_J = 1 / V and Σ y_I = 1 / (12 - V) in every equilibrium, and 1 / V = min { Σ v : v >= 0, R v >= 1 }.
TEST(BimatrixGamesTest, ZeroSumGamesHaveTheValueOfTheLinearProgram) {
  LcpGenerator generator(4);
  for (int k = 0; k < 60; ++k) {
    const Index m = generator.Integer(1, 45), n = generator.Integer(1, 45);
    const GameCosts costs = DrawCosts(m, n, [&] {
      const double cost = k % 2 == 0 ? generator.Uniform(1, 11) : static_cast<double>(generator.Integer(1, 11));
      return std::pair(cost, 12 - cost);
    });
    const LcpOutcome outcome = SolveGame(MatrixOfGame(costs), Vector::Constant(m + n, -1));
    ASSERT_EQ(outcome.verdict, LcpStatus::kSolved);
    Matrix square = Matrix::Zero(std::max(m, n), std::max(m, n));
    square.topLeftCorner(m, n) = costs.R;
    Vector q = Vector::Zero(square.rows());
    q.head(m).setConstant(-1);
    const std::optional<Vector> v = testing::MinimizeSumOverFeasible(square, q);
    ASSERT_TRUE(v.has_value());
    const double value = 1 / v->sum();
    EXPECT_NEAR(outcome.y.tail(n).sum(), 1 / value, 1e-8);  // CLP's tolerance is 1e-9
    EXPECT_NEAR(outcome.y.head(m).sum(), 1 / (12 - value), 1e-8);
  }
}

// Games beside each other, and strategies that are too good or too bad to count: q_i >= 0 with a row that is not
// negative has y_i = 0.
TEST(BimatrixGamesTest, SeparatesGamesAndLeavesOutWhatIsZero) {
  LcpGenerator generator(5);
  for (int k = 0; k < 40; ++k) {
    Matrix M = Matrix::Zero(0, 0);
    for (int game = 0; game < 3; ++game) {
      const Matrix block = MatrixOfGame(DrawCosts(generator.Integer(1, 9), generator.Integer(1, 9), [&] {
        return std::pair<double, double>(generator.Integer(1, 9), generator.Integer(1, 9));
      }));
      Matrix both = Matrix::Zero(M.rows() + block.rows(), M.rows() + block.rows());
      both.topLeftCorner(M.rows(), M.rows()) = M;
      both.bottomRightCorner(block.rows(), block.rows()) = block;
      M = both;
    }
    // Two more, whose entries on both sides and on the diagonal do not matter.
    const Index n = M.rows();
    Matrix all = Matrix::Zero(n + 2, n + 2);
    all.topLeftCorner(n, n) = M;
    for (Index i = 0; i < n; ++i) {
      all(i, n) = generator.Uniform(-3, 3);
      all(i, n + 1) = generator.Uniform(-3, 3);
      all(n, i) = generator.Uniform(0, 3);
      all(n + 1, i) = generator.Uniform(0, 3);
    }
    all(n, n) = 1;
    all(n + 1, n) = -5;  // once y_n is zero, this row is not negative either
    Vector q = Vector::Constant(n + 2, -1);
    q.tail(2) << 0.5, 2;
    ExpectSolvedAsGame(all, q, "three games");
    const LcpOutcome outcome = SolveGame(all, q);
    EXPECT_EQ(outcome.y.tail(2), Vector::Zero(2));
  }
}

// y_0 must be zero, for w_0 > 0; then w_1 < 0. Infeasible, although q + M y >= 0 is possible.
TEST(BimatrixGamesTest, ProvesByItsSignsThatNoneIsThere) {
  const Matrix M{{0, 1}, {1, 0}};
  EXPECT_EQ(SolveGame(M, Vector{{1.0, -1.0}}).verdict, LcpStatus::kInfeasible);
  const Index n = 14;
  Matrix large = Matrix::Zero(2 * n, 2 * n);
  large.topRightCorner(n, n).setOnes();
  large.bottomLeftCorner(n, n).setConstant(2);
  Vector q = Vector::Constant(2 * n, -1);
  q.head(n).setConstant(1e-3);
  EXPECT_EQ(SolveGame(large, q).verdict, LcpStatus::kInfeasible);
  // With q_0 = 0 instead, y_0 = 1 solves it.
  EXPECT_EQ(SolveGame(M, Vector{{0.0, -1.0}}).verdict, LcpStatus::kSolved);
}

// GameCosts of zero and below: there may be no solution. What is found is one, and of those that exist most are found.
TEST(BimatrixGamesTest, GamesWithZerosAndGainsAgainstEnumeration) {
  LcpGenerator generator(6);
  int solvable = 0, found = 0, unsolvable = 0;
  for (int k = 0; k < 150; ++k) {
    const Index m = generator.Integer(2, 4), n = generator.Integer(2, 4), least = k % 3 == 0 ? -3 : 0;
    const Index most_factor = k % 3 == 1 ? 1 : 3, least_factor = k % 3 == 1 ? 0 : 3;
    const auto cost = [&] {
      return static_cast<double>(generator.Integer(least, 5) * generator.Integer(least_factor, most_factor));
    };
    const Matrix M = MatrixOfGame(DrawCosts(m, n, [&] { return std::pair(cost(), cost()); }));
    Vector q = Vector::Constant(m + n, -1);
    if (k % 4 == 0) q.head(m).setOnes();
    const bool has_solution = testing::HasSolutionByEnumeration(M, q);
    ScaledLcp lcp(M);
    ASSERT_TRUE(lcp.Load(q, Vector::Zero(m + n)));
    const std::optional<BimatrixGames> games = FindBimatrixGames(lcp);
    if (games && games->is_infeasible) {
      ++unsolvable;
      EXPECT_FALSE(has_solution) << M << "\n" << q.transpose();
    }
    Basis basis(m + n, 0);
    Index pivots = 0;
    BasisPoint point(lcp, Elimination::kPivoting);
    const bool solves = games && !games->is_infeasible && SolveByLemkeHowson(lcp, *games, basis, pivots);
    if (solves) {
      ASSERT_TRUE(point.Compute(lcp, basis));
      EXPECT_TRUE(point.solved());
    }
    solvable += has_solution;
    found += solves;
  }
  EXPECT_GT(unsolvable, 5);
  EXPECT_GT(solvable, 30);
  EXPECT_GT(found, 0.9 * solvable);
}

// Skew: a linear program and its dual. Lemke's method decides them, as before.
TEST(BimatrixGamesTest, LinearProgramsStayWithLemke) {
  const Matrix A{{1, 2}, {3, 1}};
  const Matrix M = MatrixOfGame({-A.transpose(), A.transpose()});
  const LcpOutcome outcome = SolveGame(M, Vector{{1.0, 1, -1, -1}});
  EXPECT_EQ(outcome.verdict, LcpStatus::kSolved);
  EXPECT_EQ(outcome.method, "Lemke");
}

TEST(BimatrixGamesTest, ThreeSidesAreNoGame) {
  Matrix M = Matrix::Ones(3, 3);
  M.diagonal().setZero();
  ScaledLcp lcp(M);
  ASSERT_TRUE(lcp.Load(Vector::Constant(3, -1), Vector::Zero(3)));
  EXPECT_FALSE(FindBimatrixGames(lcp).has_value());
}

// 7 x 7 strategies with costs from 1 to 11, on which Lemke's method ends in a ray.
TEST(BimatrixGamesTest, SolveLcpFindsWhatLemkesMethodMisses) {
  const Matrix R{{1, 5, 4, 2, 5, 3, 2}, {9, 11, 8, 8, 2, 1, 11}, {6, 2, 10, 3, 10, 6, 3}, {8, 8, 8, 4, 9, 1, 7},
                 {6, 6, 5, 5, 6, 1, 3}, {3, 4, 5, 8, 1, 6, 9},   {2, 10, 2, 5, 10, 11, 7}};
  const Matrix C_transposed{{11, 3, 6, 4, 6, 9, 10}, {7, 1, 10, 4, 6, 8, 2},  {8, 4, 2, 4, 7, 7, 10},
                            {10, 4, 9, 8, 7, 4, 7},  {7, 10, 2, 3, 6, 11, 2}, {9, 11, 6, 11, 11, 6, 1},
                            {10, 1, 9, 5, 9, 3, 5}};
  Matrix M = Matrix::Zero(14, 14);
  M.topRightCorner(7, 7) = R;
  M.bottomLeftCorner(7, 7) = C_transposed;
  const Vector q = Vector::Constant(14, -1);
  ScaledLcp lcp(M);
  ASSERT_TRUE(lcp.Load(q, Vector::Zero(14)));
  Lemke lemke(14);
  Basis basis(14, 0);
  ASSERT_EQ(lemke.Run(lcp, 1e-11, basis), LemkeEnd::kRay);
  const absl::StatusOr<LcpResult> result = SolveLcp(M, q, SolutionRule::kAuto);
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_EQ(result->verdict, LcpStatus::kSolved);
  EXPECT_EQ(result->method, "Lemke-Howson");
  EXPECT_LE(result->residual, 1e-14);
  ExpectSolution(M, q, result->y);
}

}  // namespace
}  // namespace dlcs
