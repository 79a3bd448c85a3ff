// SPDX-License-Identifier: Apache-2.0
// LCP(q, B + R) by factors of a band: against the dense solver, and where it must give up.
#include "core/lcp/structured/splitting_solver.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/discretization/scheme.h"
#include "core/lcp/lcp.h"
#include "core/linalg/norms.h"
#include "core/models/signorini.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

// M + K_0 of a step of the Signorini problem.
Matrix CoupledSignorini(Index cells, double coefficient, double step) {
  SignoriniModel model;
  model.cells = cells;
  model.coefficient = coefficient;
  const Problem problem = MakeSignoriniProblem(model).value();
  return problem.M.Dense() + problem.N.Dense() * ExponentialPiecewiseLinear(problem, step).y_after;
}

// Entries that fall off like decay^|i - j|, the tridiagonal part an M-matrix.
Matrix Decaying(LcpGenerator& generator, Index n, double decay) {
  Matrix K(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      const double size = std::pow(decay, static_cast<double>(std::abs(i - j)));
      K(i, j) = std::abs(i - j) <= 1 ? -size : size * generator.Uniform(-1, 1);
    }
    K(i, i) = 2.5;
  }
  return K;
}

void ExpectTheSolution(const Matrix& K, const Vector& q, const Vector& guess) {
  std::optional<BandSplitting> split = SplitOffBand(K, 0.9);
  ASSERT_TRUE(split.has_value());
  SplittingLcpSolver solver(*std::move(split));
  Vector y = guess;
  const Vector tolerance = Vector::Zero(q.size());
  ASSERT_EQ(solver.Solve(q, tolerance, y), SplittingVerdict::kSolved);
  EXPECT_GE(y.minCoeff(), 0);
  EXPECT_LE(LcpResidual(K, q, y), 1e-13 * (MaxAbs(q) + InfinityNorm(K) * MaxAbs(y)));
  Basis basis(q.size(), 0);
  Vector dense(q.size());
  ASSERT_EQ(MakeLcpSolver(K, Selection::kUnique)->Solve(q, tolerance, basis, dense), LcpStatus::kSolved);
  EXPECT_LE(MaxAbs(y - dense), 1e-11 * (1 + MaxAbs(dense)));
}

TEST(SplittingLcpSolverTest, AgreesWithTheDenseSolver) {
  LcpGenerator generator(1);
  for (const Index n : {3, 10, 80}) {
    for (const double decay : {0.05, 0.2, 0.4}) {
      const Matrix K = Decaying(generator, n, decay);
      for (int k = 0; k < 5; ++k) {
        ExpectTheSolution(K, generator.GaussianVector(n), k == 0 ? Vector::Zero(n) : generator.GaussianVector(n));
      }
    }
  }
}

TEST(SplittingLcpSolverTest, SolvesTheCoupledStepOfTheSignoriniProblem) {
  LcpGenerator generator(2);
  for (const double coefficient : {2e-4, 2e-2}) {
    const Matrix K = CoupledSignorini(14, coefficient, 0.01);
    for (int k = 0; k < 5; ++k) {
      ExpectTheSolution(K, generator.GaussianVector(K.rows()), Vector::Zero(K.rows()));
    }
  }
}

TEST(SplittingLcpSolverTest, TakesFewIterationsFromAGoodGuess) {
  LcpGenerator generator(3);
  for (const double coefficient : {2e-4, 2e-2, 0.2}) {
    const Matrix K = CoupledSignorini(14, coefficient, 0.01);
    SplittingLcpSolver solver(SplitOffBand(K).value());
    const Vector q = generator.GaussianVector(K.rows());
    Vector y = Vector::Zero(K.rows());
    ASSERT_EQ(solver.Solve(q, Vector::Zero(K.rows()), y), SplittingVerdict::kSolved);
    const Vector solution = y;
    ASSERT_EQ(solver.Solve(q, Vector::Zero(K.rows()), y), SplittingVerdict::kSolved);
    EXPECT_EQ(solver.iterations(), 1);
    EXPECT_EQ(y, solution);
    y *= 1 + 1e-4;
    ASSERT_EQ(solver.Solve(q, Vector::Zero(K.rows()), y), SplittingVerdict::kSolved);
    EXPECT_LE(solver.iterations(), 5);
  }
}

// Bases that come and go, with one solver and with fresh ones.
TEST(SplittingLcpSolverTest, HasBitsThatDoNotDependOnEarlierSolves) {
  LcpGenerator generator(6);
  const BandSplitting split = SplitOffBand(CoupledSignorini(14, 2e-2, 0.01)).value();
  SplittingLcpSolver kept(split);
  const Index n = split.B->size();
  for (int k = 0; k < 30; ++k) {
    const Vector q = generator.GaussianVector(n), guess = generator.GaussianVector(n);
    Vector y = guess, fresh = guess;
    ASSERT_EQ(kept.Solve(q, Vector::Zero(n), y), SplittingVerdict::kSolved);
    ASSERT_EQ(SplittingLcpSolver(split).Solve(q, Vector::Zero(n), fresh), SplittingVerdict::kSolved);
    EXPECT_EQ(y, fresh);
  }
}

// B = 1 and K = ρ: the iterates are max(0, y + 1 - ρ y).
TEST(SplittingLcpSolverTest, SaysWhenItDoesNotContract) {
  for (const double rho : {0.9, 1.5, 0.6, 0.05, 2.5, -3.0, std::numeric_limits<double>::quiet_NaN()}) {
    BandSplitting split = SplitOffBand(Matrix::Ones(1, 1)).value();
    split.product = BandProduct(Matrix::Constant(1, 1, rho), 0);
    SplittingLcpSolver solver(std::move(split));
    Vector y = Vector::Zero(1);
    const SplittingVerdict verdict = solver.Solve(Vector{{-1.0}}, Vector::Zero(1), y);
    if (std::abs(rho - 1) <= 0.6) {
      ASSERT_EQ(verdict, SplittingVerdict::kSolved) << rho;
      EXPECT_NEAR(y[0], 1 / rho, 1e-13 / rho);
    } else {
      EXPECT_NE(verdict, SplittingVerdict::kSolved) << rho;
    }
  }
}

TEST(SplitOffBandTest, BoundsTheContraction) {
  LcpGenerator generator(4);
  const Matrix K = Decaying(generator, 30, 0.4);
  const BandSplitting split = SplitOffBand(K, 0.9).value();
  const Index b = split.B->bandwidth();
  Matrix B = Matrix::Zero(30, 30);
  for (Index i = 0; i < 30; ++i) {
    for (Index j = std::max<Index>(0, i - b); j <= std::min<Index>(29, i + b); ++j) {
      B(i, j) = i == j ? K(i, j) : std::min(K(i, j), 0.0);
    }
  }
  const Matrix bound = B.inverse() * (K - B).cwiseAbs();
  EXPECT_NEAR(split.rate, InfinityNorm(bound), 1e-12);
}

// From the coupled step, whose K_0 is wider than any tridiagonal part of it: the band grows with the diffusion.
TEST(SplitOffBandTest, TakesTheBandThatTheRateNeeds) {
  Index last = 0;
  for (const double coefficient : {2e-4, 2e-3, 2e-2, 2.0}) {
    const BandSplitting split = SplitOffBand(CoupledSignorini(20, coefficient, 0.01)).value();
    EXPECT_LE(split.rate, 3e-4);
    EXPECT_GE(split.B->bandwidth(), last);
    last = split.B->bandwidth();
  }
  EXPECT_GT(last, 8);
}

TEST(SplitOffBandTest, RefusesWhatItDoesNotServe) {
  LcpGenerator generator(5);
  EXPECT_FALSE(SplitOffBand(generator.PositiveDefinite(12)).has_value());  // no H-matrix
  EXPECT_FALSE(SplitOffBand(2.0 * Matrix::Identity(9, 9) + Matrix::Ones(9, 9)).has_value());
  EXPECT_FALSE(SplitOffBand(Matrix::Constant(2, 2, std::numeric_limits<double>::quiet_NaN())).has_value());
  Matrix far = 2.0 * Matrix::Identity(9, 9);
  far(0, 8) = 1.9;
  EXPECT_FALSE(SplitOffBand(far).has_value());
  far(0, 8) = 0.9;
  EXPECT_DOUBLE_EQ(SplitOffBand(far).value().rate, 0.45);
}

}  // namespace
}  // namespace dlcs
