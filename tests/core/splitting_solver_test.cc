// SPDX-License-Identifier: Apache-2.0
// LCP(q, T + R) by tridiagonal LCPs: against the dense solver, and where it must give up.
#include "core/lcp/splitting_solver.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "core/linalg/norms.h"
#include "core/methods/scheme.h"
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
  const std::optional<TridiagonalSplitting> split = SplitOffTridiagonal(K, 0.9);
  ASSERT_TRUE(split.has_value());
  SplittingLcpSolver solver(split->T, split->remainder);
  Vector y = guess;
  const Vector tolerance = Vector::Zero(q.size());
  ASSERT_EQ(solver.Solve(q, tolerance, y), SplittingVerdict::kSolved) << "rate " << solver.rate();
  EXPECT_GE(y.minCoeff(), 0);
  EXPECT_LE(LcpResidual(K, q, y), 1e-13 * (MaxAbs(q) + InfinityNorm(K) * MaxAbs(y)));
  Basis basis(q.size(), 0);
  Vector dense(q.size());
  ASSERT_EQ(MakeLcpSolver(K, Selection::kUnique)->Solve(q, tolerance, basis, dense), LcpVerdict::kSolved);
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
  const Matrix K = CoupledSignorini(14, 2e-4, 0.01);
  const TridiagonalSplitting split = SplitOffTridiagonal(K).value();
  SplittingLcpSolver solver(split.T, split.remainder);
  const Vector q = generator.GaussianVector(K.rows());
  Vector y = Vector::Zero(K.rows());
  ASSERT_EQ(solver.Solve(q, Vector::Zero(K.rows()), y), SplittingVerdict::kSolved);
  EXPECT_LE(solver.rate(), 1.1 * split.rate);
  const Vector solution = y;
  ASSERT_EQ(solver.Solve(q, Vector::Zero(K.rows()), y), SplittingVerdict::kSolved);
  EXPECT_EQ(solver.iterations(), 1);
  EXPECT_LE(MaxAbs(y - solution), 1e-14 * MaxAbs(solution));
}

// T = 1, R = ρ: the iterates are y^{k+1} = max(0, 1 - ρ y^k).
TEST(SplittingLcpSolverTest, SaysWhenItDoesNotContract) {
  Tridiagonal T(1);
  T.diagonal[0] = 1;
  for (const double rho : {0.1, -0.5, 0.6, 0.95, 2.0, -3.0, std::numeric_limits<double>::quiet_NaN()}) {
    SplittingLcpSolver solver(T, [rho](const Vector& y, Vector& result) { result = rho * y; });
    Vector y = Vector::Zero(1);
    const SplittingVerdict verdict = solver.Solve(Vector{{-1.0}}, Vector::Zero(1), y);
    if (std::abs(rho) <= 0.6) {
      ASSERT_EQ(verdict, SplittingVerdict::kSolved) << rho;
      EXPECT_NEAR(y[0], 1 / (1 + rho), 1e-13);
      EXPECT_NEAR(solver.rate(), std::abs(rho), 1e-2);
    } else {
      EXPECT_NE(verdict, SplittingVerdict::kSolved) << rho;
    }
  }
}

TEST(SplitOffTridiagonalTest, BoundsTheContraction) {
  LcpGenerator generator(4);
  const Matrix K = Decaying(generator, 30, 0.4);
  const TridiagonalSplitting split = SplitOffTridiagonal(K, 0.9).value();
  Matrix T = Matrix::Zero(30, 30), R = K;
  for (const Index d : {-1, 0, 1}) {
    T.diagonal(d) = K.diagonal(d);
    R.diagonal(d).setZero();
  }
  const Matrix bound = T.inverse() * R.cwiseAbs();
  EXPECT_NEAR(split.rate, InfinityNorm(bound), 1e-12);
  Vector applied(30);
  const Vector y = generator.GaussianVector(30);
  split.remainder(y, applied);
  EXPECT_LE(MaxAbs(applied - R * y), 1e-14);
}

TEST(SplitOffTridiagonalTest, RefusesWhatItDoesNotServe) {
  LcpGenerator generator(5);
  EXPECT_FALSE(SplitOffTridiagonal(generator.PositiveDefinite(12)).has_value());  // T is no M-matrix
  EXPECT_FALSE(SplitOffTridiagonal(2.0 * Matrix::Identity(9, 9) + Matrix::Ones(9, 9)).has_value());
  EXPECT_FALSE(SplitOffTridiagonal(Matrix::Constant(2, 2, std::numeric_limits<double>::quiet_NaN())).has_value());
  Matrix far = 2.0 * Matrix::Identity(9, 9);
  far(0, 8) = 1.9;
  EXPECT_FALSE(SplitOffTridiagonal(far).has_value());
  far(0, 8) = 0.9;
  EXPECT_DOUBLE_EQ(SplitOffTridiagonal(far).value().rate, 0.45);
}

}  // namespace
}  // namespace dlcs
