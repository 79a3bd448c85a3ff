// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/complementary_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/lcp/lcp.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;
using Known = ComplementarySolver::Known;

Basis RandomBasis(LcpGenerator& generator, Index n) {
  Basis basis(n);
  for (std::uint8_t& entry : basis) entry = static_cast<std::uint8_t>(generator.Integer(0, 1));
  return basis;
}

// The promise of LcpSolver::Solve().
double AllowedResidual(const Matrix& M, const Vector& q, const Vector& y, double tolerance) {
  const double norm = M.cwiseAbs().rowwise().sum().maxCoeff();
  return 10 * tolerance + 1e-12 * (q.lpNorm<Eigen::Infinity>() + norm * y.lpNorm<Eigen::Infinity>());
}

TEST(ComplementarySolverTest, WarmStartsWithWrongGuessesEqualColdStarts) {
  LcpGenerator generator(1);
  for (const Index n : {1, 2, 5, 15, 60}) {
    const Matrix M = n % 2 == 0 ? generator.PositiveDefinite(n) : generator.MMatrix(n);
    ComplementarySolver solver(M, n % 2 == 0 ? Known::kPMatrix : Known::kMMatrix);
    for (int k = 0; k < 30; ++k) {
      const Vector q = generator.SolvableQ(M, k % 2 == 0);
      Basis cold(n, 0);
      Vector y(n);
      ASSERT_EQ(solver.Solve(q, Vector::Constant(q.size(), 1e-14), cold, y), LcpStatus::kSolved);
      Basis warm = RandomBasis(generator, n);
      Vector again(n);
      ASSERT_EQ(solver.Solve(q, Vector::Constant(q.size(), 1e-14), warm, again), LcpStatus::kSolved);
      EXPECT_LE((y - again).lpNorm<Eigen::Infinity>(), 1e-10);
      if (k % 2 == 1) {
        EXPECT_EQ(cold, warm);
        EXPECT_EQ(y, again);
      }
    }
  }
}

// Steps of length h with skew M have M + h N B. Where a diagonal entry of size h counts as much as the others, the
// basis {0, 1, 2} looks singular.
TEST(ComplementarySolverTest, TinyDiagonalsBesideLargeEntries) {
  constexpr double h = 0x1p-31;
  Matrix M(4, 4), NB(4, 4);
  M << 0, 0.5, 2, -0.5, -0.5, 0, 0, -1.5, -2, 0, 0, 1, 0.5, 1.5, -1, 0;
  NB << 4.25, -0.5, -1.75, 1, -0.5, 1.25, 1, -0.25, -1.75, 1, 1.25, -0.5, 1, -0.25, -0.5, 0.25;
  const Matrix coupled = M + h * NB;
  const Vector y{{1.5, 12, 0.25, 0}}, w{{0, 0, 0, 18}};
  const Vector q = w - coupled * y;
  ComplementarySolver solver(coupled, Known::kNothing);
  for (const double tolerance : {0.0, 1e-14}) {
    Basis basis(4, 0);
    Vector found(4);
    ASSERT_EQ(solver.Solve(q, Vector::Constant(4, tolerance), basis, found), LcpStatus::kSolved);
    EXPECT_LE((found - y).lpNorm<Eigen::Infinity>(), 1e-4);
    EXPECT_LE(LcpResidual(coupled, q, found), 1e-13);
  }
}

// The bits of an answer depend on the arguments of the call alone, not on what the solver did before.
TEST(ComplementarySolverTest, IsAPureFunctionOfItsArguments) {
  LcpGenerator generator(2);
  for (const Selection selection : {Selection::kUnique, Selection::kLeastElement, Selection::kAny}) {
    for (const Index n : {3, 9, 30}) {
      const Matrix M = selection == Selection::kUnique         ? generator.PositiveDefinite(n)
                       : selection == Selection::kLeastElement ? generator.SingularMMatrix(n)
                                                               : generator.PositiveSemidefinite(n, n / 2);
      const Matrix K = 1e-2 * generator.Gaussian(n, n);
      const std::unique_ptr<LcpSolver> plain = MakeLcpSolver(M, selection);
      const std::unique_ptr<LcpSolver> coupled = MakeCoupledLcpSolver(M, K, selection);
      for (int k = 0; k < 60; ++k) {
        const Vector q = generator.GaussianVector(n);
        const Basis guess = RandomBasis(generator, n);
        for (const LcpSolver* used : {plain.get(), coupled.get()}) {
          const std::unique_ptr<LcpSolver> fresh =
              used == plain.get() ? MakeLcpSolver(M, selection) : MakeCoupledLcpSolver(M, K, selection);
          const std::unique_ptr<LcpSolver> clone = used->Clone();
          for (LcpSolver* solver : {const_cast<LcpSolver*>(used), clone.get()}) {
            Basis basis = guess;
            Basis fresh_basis = guess;
            Vector y(n), fresh_y(n);
            const LcpStatus verdict = solver->Solve(q, Vector::Constant(q.size(), 1e-13), basis, y);
            EXPECT_EQ(verdict, fresh->Solve(q, Vector::Constant(q.size(), 1e-13), fresh_basis, fresh_y));
            EXPECT_EQ(y, fresh_y);
            EXPECT_EQ(basis, fresh_basis);
          }
        }
      }
    }
  }
}

// Index one: M = 0 and K = h·NB with h down to 1e-9. y is of size one, q and w of size h.
TEST(ComplementarySolverTest, SolvesTinyCoupledBlocks) {
  LcpGenerator generator(3);
  for (const double h : {1e-3, 1e-6, 1e-9, 1e-12}) {
    for (int k = 0; k < 100; ++k) {
      const Index n = generator.Integer(1, 6);
      const Matrix K = h * generator.PositiveDefinite(n);
      const std::unique_ptr<LcpSolver> solver =
          MakeCoupledLcpSolver(Matrix::Zero(n, n), K, k % 2 == 0 ? Selection::kAny : Selection::kLeastElement);
      Vector y;
      const Vector q = generator.SolvableQ(K / h, k % 4 < 2, &y) * h;
      Basis basis = RandomBasis(generator, n);
      Vector found(n);
      ASSERT_EQ(solver->Solve(q, Vector::Constant(q.size(), 1e-16 * h), basis, found), LcpStatus::kSolved)
          << solver->Account().message;
      EXPECT_LE((found - y).lpNorm<Eigen::Infinity>(), 1e-9);
      EXPECT_LE(LcpResidual(K, q, found), AllowedResidual(K, q, found, 1e-16 * h));
    }
  }
}

// Relays and friction: M skew with entries of size one, K acting on half of the pairs with size h.
TEST(ComplementarySolverTest, SolvesTinyBlocksNextToEntriesOfSizeOne) {
  LcpGenerator generator(4);
  for (const double h : {1e-2, 1e-6, 1e-9}) {
    for (int k = 0; k < 200; ++k) {
      const Index pairs = generator.Integer(1, 4);
      const Index n = 2 * pairs;
      Matrix M = Matrix::Zero(n, n);
      M.topRightCorner(pairs, pairs).setIdentity();
      M.bottomLeftCorner(pairs, pairs) = -Matrix::Identity(pairs, pairs);
      Matrix K = Matrix::Zero(n, n);
      K.topLeftCorner(pairs, pairs) = h * generator.PositiveDefinite(pairs);
      // w1 = v + h(...)y1 + y2, w2 = 2 - y1: sticking where |v| is of size h, sliding elsewhere.
      Vector q(n);
      q.tail(pairs).setConstant(2);
      for (Index i = 0; i < pairs; ++i) q[i] = generator.Normal() * (k % 3 == 0 ? 1.0 : h);
      const std::unique_ptr<LcpSolver> solver = MakeCoupledLcpSolver(M, K, Selection::kAny);
      Basis basis = RandomBasis(generator, n);
      Vector y(n);
      ASSERT_EQ(solver->Solve(q, Vector::Constant(q.size(), 1e-15), basis, y), LcpStatus::kSolved)
          << solver->Account().message;
      EXPECT_LE(LcpResidual(M + K, q, y), AllowedResidual(M + K, q, y, 1e-15));
      Basis again = basis;
      Vector y_again(n);
      ASSERT_EQ(solver->Solve(q, Vector::Constant(q.size(), 1e-15), again, y_again), LcpStatus::kSolved);
      EXPECT_EQ(solver->Account().pivots, 0);
      EXPECT_EQ(y, y_again);
    }
  }
}

// Circuits: entries from 1e-12 to 1e12 after a change of units that does not touch the problem.
TEST(ComplementarySolverTest, KeepsItsPromiseInAnyUnits) {
  LcpGenerator generator(5);
  for (int k = 0; k < 600; ++k) {
    const Index n = generator.Integer(1, 12);
    const Matrix inner = k % 3 == 0   ? generator.PositiveDefinite(n)
                         : k % 3 == 1 ? generator.PositiveSemidefinite(n, (n + 1) / 2)
                                      : generator.Skew(n);
    const Vector scale = generator.GaussianVector(n).unaryExpr(
        [](double v) { return std::pow(10.0, std::max(-6.0, std::min(6.0, 3 * v))); });
    const Matrix M = scale.asDiagonal() * inner * scale.asDiagonal();
    const Vector q = scale.asDiagonal() * generator.SolvableQ(inner, k % 2 == 0);
    ComplementarySolver solver(M, Known::kNothing);
    Basis basis = RandomBasis(generator, n);
    Vector y(n);
    ASSERT_EQ(solver.Solve(q, Vector::Constant(q.size(), 0), basis, y), LcpStatus::kSolved)
        << k << " " << solver.Account().message;
    EXPECT_LE(LcpResidual(M, q, y), AllowedResidual(M, q, y, 0)) << k;
    // In the units of the inner problem it is as good.
    const Vector inner_y = y.cwiseProduct(scale);
    const Vector inner_q = q.cwiseQuotient(scale);
    EXPECT_LE(LcpResidual(inner, inner_q, inner_y), 1e-11 * (1 + inner_y.maxCoeff()) * static_cast<double>(n)) << k;
  }
}

}  // namespace
}  // namespace dlcs
