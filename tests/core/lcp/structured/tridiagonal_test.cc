// SPDX-License-Identifier: Apache-2.0
// Tridiagonal M-matrices: policy iteration alone, in lanes, as a solver and in batches. Judged by the
// solution that a problem was built from, by other solvers, and bit by bit against each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "core/lcp/batch.h"
#include "core/lcp/dense/complementary_solver.h"
#include "core/lcp/structured/tridiagonal_solver.h"
#include "core/linalg/norms.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

// A nonsymmetric M-matrix, dominant by rows by at least `dominance`.
Tridiagonal RandomTridiagonal(LcpGenerator& generator, Index n, double dominance) {
  Tridiagonal M(n);
  for (Index i = 0; i < n; ++i) {
    if (i > 0 && generator.Integer(0, 9) > 0) M.below[i] = -generator.Uniform(0, 1);
    if (i + 1 < n && generator.Integer(0, 9) > 0) M.above[i] = -generator.Uniform(0, 1);
    M.diagonal[i] = dominance - M.below[i] - M.above[i];
  }
  return M;
}

Matrix Dense(const Tridiagonal& M) {
  Matrix result = Matrix::Zero(M.size(), M.size());
  for (Index i = 0; i < M.size(); ++i) {
    result(i, i) = M.diagonal[i];
    if (i > 0) result(i, i - 1) = M.below[i];
    if (i + 1 < M.size()) result(i, i + 1) = M.above[i];
  }
  return result;
}

Vector Times(const Tridiagonal& M, const Vector& y) {
  Vector result = M.diagonal.cwiseProduct(y);
  const Index n = M.size();
  result.tail(n - 1) += M.below.tail(n - 1).cwiseProduct(y.head(n - 1));
  result.head(n - 1) += M.above.head(n - 1).cwiseProduct(y.tail(n - 1));
  return result;
}

// q with the solution y; some indices have y_i = w_i = 0.
Vector SolvableQ(LcpGenerator& generator, const Tridiagonal& M, Vector& y) {
  y = Vector::Zero(M.size());
  Vector w = Vector::Zero(M.size());
  for (Index i = 0; i < M.size(); ++i) {
    const Index kind = generator.Integer(0, 4);
    if (kind < 2) y[i] = generator.Uniform(0, 2);
    if (kind > 2) w[i] = generator.Uniform(0, 2);
  }
  return w - Times(M, y);
}

Eigen::SparseMatrix<double> SparseCopy(const Matrix& M) { return M.sparseView(0, 0); }

std::shared_ptr<const Tridiagonal> Shared(const Tridiagonal& M) { return std::make_shared<const Tridiagonal>(M); }

TEST(TridiagonalTest, IsReadFromDenseAndSparseMatrices) {
  LcpGenerator generator(1);
  const Tridiagonal M = RandomTridiagonal(generator, 6, 0.5);
  const Matrix dense = Dense(M);
  for (const std::optional<Tridiagonal>& read : {TridiagonalOf(dense), TridiagonalOf(SparseCopy(dense))}) {
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->below, M.below);
    EXPECT_EQ(read->diagonal, M.diagonal);
    EXPECT_EQ(read->above, M.above);
  }
  Matrix corner = dense;
  corner(5, 0) = 1e-300;
  EXPECT_FALSE(TridiagonalOf(corner).has_value());
  EXPECT_FALSE(TridiagonalOf(SparseCopy(corner)).has_value());
}

TEST(TridiagonalTest, KnowsMMatricesFromOthers) {
  const auto with = [](double below, double diagonal, double above) {
    Tridiagonal M(9);
    M.below.tail(8).setConstant(below);
    M.diagonal.setConstant(diagonal);
    M.above.head(8).setConstant(above);
    return M;
  };
  EXPECT_TRUE(IsClearlyMMatrix(with(-1, 2, -1)));
  EXPECT_TRUE(IsClearlyMMatrix(with(-2, 2, -0.5)));
  EXPECT_FALSE(IsClearlyMMatrix(with(-1, 2, 1e-9)));  // no Z-matrix
  EXPECT_FALSE(IsClearlyMMatrix(with(-1, 1.9, -1)));  // its least eigenvalue is 1.9 - 2 cos(π/10) < 0
  EXPECT_FALSE(IsClearlyMMatrix(with(-1, std::numeric_limits<double>::quiet_NaN(), -1)));
  Tridiagonal laplacian = with(-1, 2, -1);  // singular: M·1 = 0
  laplacian.diagonal[0] = laplacian.diagonal[8] = 1;
  EXPECT_FALSE(IsClearlyMMatrix(laplacian));
}

TEST(PolicyIterationTest, FindsTheSolutionThatAProblemWasBuiltFrom) {
  LcpGenerator generator(2);
  for (const Index n : {2, 3, 7, 40, 255}) {
    for (int k = 0; k < 40; ++k) {
      const Tridiagonal M = RandomTridiagonal(generator, n, 0.1);
      Vector expected;
      const Vector q = SolvableQ(generator, M, expected);
      Basis basis(n);
      for (std::uint8_t& basic : basis) basic = generator.Integer(0, 1) != 0;
      Vector y(n);
      Index pivots = 0;
      PolicyIteration iteration(n);
      ASSERT_TRUE(iteration.Solve(M, q, Vector::Zero(n), basis, y, pivots));
      EXPECT_GE(y.minCoeff(), 0);
      // ‖M⁻¹‖ <= 1 / 0.1
      EXPECT_LE((y - expected).lpNorm<Eigen::Infinity>(), 10 * 1e-13 * (1 + q.lpNorm<Eigen::Infinity>()));
      EXPECT_LE(LcpResidual(Dense(M), q, y), 1e-13 * (1 + q.lpNorm<Eigen::Infinity>()));
    }
  }
}

TEST(GrowLeastBasisTest, FindsTheBasisFromNothing) {
  LcpGenerator generator(4);
  for (const Index n : {2, 3, 7, 40, 1000}) {
    for (int k = 0; k < 40; ++k) {
      const Tridiagonal M = RandomTridiagonal(generator, n, k % 2 == 0 ? 0.5 : 1e-3);
      const Vector q = generator.GaussianVector(n) + Vector::Constant(n, 0.3);
      Basis basis(n, 1), grown(n, 1);
      Vector y(n);
      Index pivots = 0;
      GrowLeastBasis(M, q, Vector::Zero(n), grown, pivots);
      EXPECT_EQ(pivots, std::count(grown.begin(), grown.end(), 1));
      basis = grown;
      pivots = 0;
      ASSERT_TRUE(PolicyIteration(n).Solve(M, q, Vector::Zero(n), basis, y, pivots));
      EXPECT_EQ(pivots, 0);
      EXPECT_LE(LcpResidual(Dense(M), q, y), 1e-13 * (1 + MaxAbs(q) + 5 * MaxAbs(y)));
    }
  }
}

TEST(PolicyIterationTest, DoesNotDependOnTheGuess) {
  LcpGenerator generator(3);
  const Index n = 60;
  const Tridiagonal M = RandomTridiagonal(generator, n, 0.05);
  const Vector q = generator.GaussianVector(n);
  PolicyIteration iteration(n);
  Vector first(n), y(n);
  for (int k = 0; k < 200; ++k) {
    Basis basis(n);
    for (std::uint8_t& basic : basis) basic = generator.Integer(0, 3) != 0;
    Index pivots = 0;
    ASSERT_TRUE(iteration.Solve(M, q, Vector::Zero(n), basis, y, pivots));
    if (k == 0) first = y;
    ASSERT_EQ(y, first);  // a nondegenerate problem has one basis, and the bits are those of the basis
  }
}

// As in a march: q moves a little, the basis now and then, also by hand between two calls.
TEST(PolicyIterationTest, HasTheSameBitsWithPivotsThatAreKept) {
  LcpGenerator generator(6);
  const Index n = 40;
  const Tridiagonal M = RandomTridiagonal(generator, n, 0.1);
  PolicyIteration kept(n);
  Vector q = generator.GaussianVector(n), y(n), fresh(n);
  Basis basis(n, 0);
  for (int k = 0; k < 60; ++k) {
    q += 0.05 * generator.GaussianVector(n);
    if (k % 7 == 0) basis[static_cast<std::size_t>(k % n)] ^= 1;
    Basis other = basis;
    Index pivots = 0, other_pivots = 0;
    ASSERT_TRUE(kept.SolveAgain(M, q, Vector::Zero(n), basis, y, pivots));
    ASSERT_TRUE(PolicyIteration(n).Solve(M, q, Vector::Zero(n), other, fresh, other_pivots));
    ASSERT_EQ(y, fresh);
    ASSERT_EQ(basis, other);
    ASSERT_EQ(pivots, other_pivots);
  }
}

TEST(PolicyIterationTest, LeavesWhatOverflowsToOthers) {
  Tridiagonal M(2);
  M.diagonal.setConstant(1e-300);
  PolicyIteration iteration(2);
  for (const double bad : {-1e300, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    Basis basis(2, 0);
    Vector y(2);
    Index pivots = 0;
    EXPECT_FALSE(iteration.Solve(M, Vector{{1.0, bad}}, Vector::Zero(2), basis, y, pivots)) << bad;
  }
}

// A string over the obstacle 0, -u'' = 8 up to x = 1/2 and -32 behind. It is a x - 4x² there, then 16 (x -
// c)², and rests on the obstacle from c on. u and u' match at 1/2 for c = √5/4, a = 20 - 8√5; differences of
// quadratics are exact.
TEST(TridiagonalSolverTest, SolvesAnObstacleProblemWithManyUnknowns) {
  const Index n = 99999;
  const double h = 1.0 / static_cast<double>(n + 1);
  Tridiagonal M(n);
  M.below.tail(n - 1).setConstant(-1);
  M.diagonal.setConstant(2);
  M.above.head(n - 1).setConstant(-1);
  const Vector x = h * Vector::LinSpaced(n, 1, static_cast<double>(n));
  Vector q(n), expected(n);
  const double c = std::sqrt(5) / 4, a = 20 - 8 * std::sqrt(5);
  for (Index i = 0; i < n; ++i) {
    const Index side = i + 1 - (n + 1) / 2;
    q[i] = h * h * (side < 0 ? -8 : side == 0 ? 12 : 32);
    expected[i] = side < 0 ? x[i] * (a - 4 * x[i]) : 16 * std::pow(std::max(0.0, c - x[i]), 2);
  }
  TridiagonalSolver solver(Shared(M), nullptr);
  Basis basis(n, 1);
  Vector y(n);
  ASSERT_EQ(solver.Solve(q, Vector::Zero(n), basis, y), LcpStatus::kSolved);
  EXPECT_LE((y - expected).lpNorm<Eigen::Infinity>(), 1e-8);
  EXPECT_LE(solver.Account().pivots, 3 * n);
}

TEST(PolicyLanesTest, HaveTheBitsOfOneAtATime) {
  LcpGenerator generator(5);
  for (const Index n : {1, 2, 5, 64, 255}) {
    const Tridiagonal M = RandomTridiagonal(generator, n, 0.1);
    PolicyIteration iteration(n);
    PolicyLanes lanes(n);
    for (Index columns = 1; columns <= PolicyLanes::kLanes; ++columns) {
      const Matrix q = generator.Gaussian(n, columns);
      const Vector tolerance = Vector::Constant(n, 1e-13);
      Matrix y = generator.Gaussian(n, columns);
      const Matrix guess = y;
      ASSERT_EQ(lanes.Solve(M, q, tolerance, y), (1u << columns) - 1);
      for (Index j = 0; j < columns; ++j) {
        Basis basis(n);
        for (Index i = 0; i < n; ++i) basis[i] = guess(i, j) > 0;
        Vector alone(n);
        Index pivots = 0;
        ASSERT_TRUE(iteration.Solve(M, q.col(j), tolerance, basis, alone, pivots));
        ASSERT_EQ(y.col(j), alone) << "n = " << n << ", column " << j << " of " << columns;
      }
    }
  }
}

TEST(PolicyLanesTest, KeepBadColumnsToThemselves) {
  LcpGenerator generator(6);
  const Index n = 20, columns = 9;
  const Tridiagonal M = RandomTridiagonal(generator, n, 0.1);
  const Vector tolerance = Vector::Zero(n);
  const Matrix q = generator.Gaussian(n, columns);
  PolicyLanes lanes(n);
  Matrix good = Matrix::Zero(n, columns);
  ASSERT_EQ(lanes.Solve(M, q, tolerance, good), 0x1ffu);
  for (Index bad = 0; bad < columns; ++bad) {
    Matrix spoiled = q;
    spoiled(bad, bad) = std::numeric_limits<double>::quiet_NaN();
    Matrix y = Matrix::Zero(n, columns);
    EXPECT_EQ(lanes.Solve(M, spoiled, tolerance, y), 0x1ffu ^ (1u << bad));
    for (Index j = 0; j < columns; ++j) EXPECT_EQ(y.col(j), j == bad ? Vector(Vector::Zero(n)) : Vector(good.col(j)));
  }
}

// Degenerate and ill-conditioned: rounding moves indices with y_i = w_i = 0 in and out of the basis.
TEST(TridiagonalSolverTest, NeedsNoOtherSolverWhereDegenerateProblemsAreBadlyScaled) {
  const Index n = 9;
  for (int seed = 0; seed < 2000; ++seed) {
    LcpGenerator generator(seed);
    const Matrix M = generator.BadlyScaled(Dense(RandomTridiagonal(generator, n, 0.1)), 3);
    Vector expected;
    const Vector q = generator.SolvableQ(M, true, &expected);
    TridiagonalSolver solver(Shared(*TridiagonalOf(M)), nullptr);
    Basis basis(n, 0);
    Vector y(n);
    ASSERT_EQ(solver.Solve(q, Vector::Zero(n), basis, y), LcpStatus::kSolved) << "seed " << seed;
    ASSERT_LE(LcpResidual(M, q, y), 1e-12 * (MaxAbs(q) + InfinityNorm(M) * MaxAbs(y))) << "seed " << seed;
  }
}

// The general solver has equilibration and another elimination: the same solution to rounding, the same
// verdicts.
TEST(TridiagonalSolverTest, AgreesWithTheGeneralSolver) {
  LcpGenerator generator(7);
  for (const Index n : {1, 2, 9, 70}) {
    for (int k = 0; k < 30; ++k) {
      Matrix M = Dense(RandomTridiagonal(generator, n, 0.1));
      if (k % 3 == 1) M = generator.BadlyScaled(M, 3);
      Vector q = k % 2 == 0 ? generator.GaussianVector(n) : generator.SolvableQ(M, true);
      if (k == 29) q[n / 2] = std::numeric_limits<double>::infinity();
      const Vector tolerance = Vector::Zero(n);
      Basis basis(n, 0), general_basis(n, 0);
      Vector y(n), general_y(n);
      const auto solver = MakeLcpSolver(M, k % 4 == 0 ? Selection::kLeastElement : Selection::kUnique);
      ComplementarySolver general(M, ComplementarySolver::Known::kMMatrix);
      const LcpStatus verdict = solver->Solve(q, tolerance, basis, y);
      ASSERT_EQ(verdict, general.Solve(q, tolerance, general_basis, general_y));
      if (verdict != LcpStatus::kSolved) continue;
      EXPECT_STREQ(solver->Account().method, "policy iteration");
      EXPECT_LE(((y - general_y).array().abs() / (1e-300 + general_y.array().abs().maxCoeff())).maxCoeff(), 1e-11);
    }
  }
}

TEST(LcpBatchTest, HasTheSameBitsForAnyNumberOfThreadsAndAnySplit) {
  LcpGenerator generator(8);
  const Index n = 33, columns = 203;
  for (const bool tridiagonal : {true, false}) {
    const Matrix M = tridiagonal ? Dense(RandomTridiagonal(generator, n, 0.1)) : generator.MMatrix(n);
    const Matrix q = generator.Gaussian(n, columns);
    const Vector tolerance = Vector::Constant(n, 1e-13);
    const auto solve = [&](int threads, Index first, Index count) {
      Workers workers(threads);
      LcpBatch batch(M, Selection::kUnique);
      Matrix y = Matrix::Zero(n, count);
      const LcpBatchOutcome outcome = batch.Solve(q.middleCols(first, count), tolerance, workers, {}, y);
      EXPECT_EQ(outcome.verdict, LcpStatus::kSolved);
      return y;
    };
    const Matrix all = solve(1, 0, columns);
    EXPECT_EQ(solve(3, 0, columns), all);
    EXPECT_EQ(solve(1, 5, 100), all.middleCols(5, 100));
    for (Index j = 0; j < columns; ++j) EXPECT_LE(LcpResidual(M, q.col(j), all.col(j)), 1e-12);
  }
}

TEST(LcpBatchTest, NamesTheFirstColumnThatFails) {
  LcpGenerator generator(9);
  const Index n = 8, columns = 70;
  const Matrix M = Dense(RandomTridiagonal(generator, n, 0.1));
  Matrix q = generator.Gaussian(n, columns);
  q(3, 61) = q(0, 40) = std::numeric_limits<double>::quiet_NaN();
  Workers workers(2);
  LcpBatch batch(M, Selection::kUnique);
  Matrix y = Matrix::Zero(n, columns);
  const LcpBatchOutcome outcome = batch.Solve(q, Vector::Zero(n), workers, {}, y);
  EXPECT_EQ(outcome.verdict, LcpStatus::kNonFinite);
  EXPECT_EQ(outcome.column, 40);
}

}  // namespace
}  // namespace dlcs
