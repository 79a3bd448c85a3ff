// SPDX-License-Identifier: Apache-2.0
// LCPs with sparse matrices: classes and solutions, against the dense tests and solvers, closed forms, and
// for sizes that no dense matrix of would fit.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "core/lcp/lcp.h"
#include "core/lcp/structured/sparse_solver.h"
#include "core/linalg/norms.h"
#include "core/matrix_classes/sparse_class.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

SparseMatrix Sparse(const Matrix& M) { return M.sparseView(0, 0); }

// The five-point differences on a square, `across` points in each direction: -Δ times the mesh width squared,
// and a wind that makes it nonsymmetric.
SparseMatrix Laplacian(Index across, double wind = 0) {
  const KroneckerSum sum{{SparseMatrix(across, across), SparseMatrix(across, across)}};
  KroneckerSum result = sum;
  for (SparseMatrix& D : result.factors) {
    for (Index i = 0; i < across; ++i) {
      D.insert(i, i) = 2;
      if (i > 0) D.insert(i, i - 1) = -1 - wind;
      if (i + 1 < across) D.insert(i, i + 1) = -1 + wind;
    }
    D.makeCompressed();
  }
  return result.Assemble();
}

// A random matrix with a few entries per row.
SparseMatrix RandomPattern(LcpGenerator& generator, Index n, Index per_row) {
  SparseMatrix M(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index k = 0; k < per_row; ++k) M.coeffRef(i, generator.Integer(0, n - 1)) = generator.Normal();
  }
  M.makeCompressed();
  return M;
}

// A + Aᵀ-like: symmetric positive definite, entries of both signs, not diagonally dominant; nonsymmetric with
// a skew part.
SparseMatrix PositiveDefinite(LcpGenerator& generator, Index n, bool symmetric) {
  const SparseMatrix G = RandomPattern(generator, n, 3);
  SparseMatrix M = G * SparseMatrix(G.transpose());
  if (!symmetric) M += SparseMatrix(G - SparseMatrix(G.transpose()));
  SparseMatrix I(n, n);
  I.setIdentity();
  return M + 0.1 * I;
}

double Residual(const SparseMatrix& M, const Vector& q, const Vector& y) { return NaturalResidual(y, q + M * y); }

// Solves a problem built from its solution, with half of the entries positive and some y_i = w_i = 0.
void ExpectSolved(LcpGenerator& generator, const SparseMatrix& M, LcpSolver& solver, double error) {
  const Index n = M.rows();
  Vector expected = Vector::Zero(n), w = Vector::Zero(n);
  for (Index i = 0; i < n; ++i) {
    const Index kind = generator.Integer(0, 9);
    if (kind < 5) expected[i] = generator.Uniform(0, 2);
    if (kind > 5) w[i] = generator.Uniform(0, 2);
  }
  const Vector q = w - M * expected;
  Basis basis(n, 0);
  Vector y(n);
  ASSERT_EQ(solver.Solve(q, Vector::Zero(n), basis, y), LcpStatus::kSolved) << solver.Account().message;
  EXPECT_GE(y.minCoeff(), 0);
  EXPECT_LE(Residual(M, q, y), 1e-12 * (MaxAbs(q) + MaxAbs(M.cwiseAbs() * Vector::Ones(n)) * MaxAbs(y)));
  EXPECT_LE(MaxAbs(y - expected), error);
}

TEST(SparseLcpSolverTest, FindsTheSolutionThatAProblemWasBuiltFrom) {
  LcpGenerator generator(1);
  for (const Index n : {1, 2, 10, 400}) {
    for (const bool symmetric : {true, false}) {
      const SparseMatrix M = PositiveDefinite(generator, n, symmetric);
      SparseLcpSolver solver(M, SparseLcpSolver::Known::kPMatrix);
      for (int k = 0; k < 3; ++k) ExpectSolved(generator, M, solver, 1e-9);
    }
  }
  for (const double wind : {0.0, 0.5}) {
    const SparseMatrix M = Laplacian(23, wind);
    SparseLcpSolver solver(M, SparseLcpSolver::Known::kMMatrix);
    for (int k = 0; k < 3; ++k) ExpectSolved(generator, M, solver, 1e-9);
  }
}

TEST(SparseLcpSolverTest, AgreesWithTheDenseSolver) {
  LcpGenerator generator(2);
  for (int k = 0; k < 20; ++k) {
    const SparseMatrix M = PositiveDefinite(generator, 60, k % 2 == 0);
    const Vector q = generator.GaussianVector(60);
    const std::unique_ptr<LcpSolver> sparse = MakeSparseLcpSolver(M, Selection::kUnique);
    const std::unique_ptr<LcpSolver> dense = MakeLcpSolver(Matrix(M), Selection::kUnique);
    Basis basis(60, 0), dense_basis(60, 1);
    Vector y(60), dense_y(60);
    ASSERT_EQ(sparse->Solve(q, Vector::Zero(60), basis, y), LcpStatus::kSolved);
    ASSERT_EQ(dense->Solve(q, Vector::Zero(60), dense_basis, dense_y), LcpStatus::kSolved);
    EXPECT_EQ(basis, dense_basis);
    EXPECT_LE(MaxAbs(y - dense_y), 1e-10 * (1 + MaxAbs(y)));
  }
}

TEST(SparseLcpSolverTest, IsAPureFunctionOfItsArguments) {
  LcpGenerator generator(3);
  const SparseMatrix M = Laplacian(15, 0.3);
  const Index n = M.rows();
  SparseLcpSolver used(M, SparseLcpSolver::Known::kMMatrix);
  for (int k = 0; k < 6; ++k) {
    const Vector q = generator.GaussianVector(n);
    SparseLcpSolver fresh(M, SparseLcpSolver::Known::kMMatrix);
    const std::unique_ptr<LcpSolver> clone = used.Clone();
    Vector expected;
    for (LcpSolver* solver : {static_cast<LcpSolver*>(&used), static_cast<LcpSolver*>(&fresh), clone.get()}) {
      Basis basis(n, 0);
      Vector y(n);
      ASSERT_EQ(solver->Solve(q, Vector::Zero(n), basis, y), LcpStatus::kSolved);
      if (expected.size() == 0) expected = y;
      EXPECT_EQ(y, expected);
    }
  }
}

TEST(SparseLcpSolverTest, SaysWhatWentWrong) {
  const SparseMatrix M = Laplacian(3);
  SparseLcpSolver solver(M, SparseLcpSolver::Known::kMMatrix);
  Basis basis(9, 0);
  Vector y(9), q = Vector::Ones(9);
  q[4] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(solver.Solve(q, Vector::Zero(9), basis, y), LcpStatus::kNonFinite);
  EXPECT_EQ(y, Vector::Zero(9));
  const SparseMatrix zero(2, 2);
  SparseLcpSolver trusting(zero, SparseLcpSolver::Known::kPMatrix);
  Basis pair(2, 0);
  Vector y2(2);
  EXPECT_EQ(trusting.Solve(-Vector::Ones(2), Vector::Zero(2), pair, y2), LcpStatus::kSingular);
}

// A membrane with a known contact set: u = (r² - a²)² outside of r = a, where -Δu = 8a² - 16r², vanishes with
// its gradient on that circle; inside the obstacle 0 carries it.
TEST(SparseLcpSolverTest, SolvesAnObstacleProblemOfTwentyThousandUnknowns) {
  const Index across = 141;
  const double h = 2.0 / static_cast<double>(across + 1), a = 0.5;
  const SparseMatrix M = Laplacian(across);
  Vector q(across * across), expected(across * across);
  for (Index i = 0; i < across; ++i) {
    for (Index j = 0; j < across; ++j) {
      const double x1 = -1 + static_cast<double>(i + 1) * h, x2 = -1 + static_cast<double>(j + 1) * h;
      const auto u = [a](double s1, double s2) { return std::pow(std::max(0.0, s1 * s1 + s2 * s2 - a * a), 2); };
      expected[i * across + j] = u(x1, x2);
      // -h²Δu of the exact solution outside of the disc, a positive reaction inside; the boundary values of u
      // go to q.
      const double r2 = x1 * x1 + x2 * x2;
      q[i * across + j] = r2 > a * a ? -h * h * (8 * a * a - 16 * r2) : h * h;
      for (const double side : {-1.0, 1.0}) {
        if ((i == 0 && side < 0) || (i == across - 1 && side > 0)) q[i * across + j] -= u(side, x2);
        if ((j == 0 && side < 0) || (j == across - 1 && side > 0)) q[i * across + j] -= u(x1, side);
      }
    }
  }
  const MatrixClass known = ClassifySparse(M);
  ASSERT_TRUE(known.p.yes() && known.z.yes()) << known.description;
  const std::unique_ptr<LcpSolver> solver = MakeSparseLcpSolver(M, SelectRule(SolutionRule::kAuto, known).value());
  Basis basis(q.size(), 1);
  Vector y(q.size());
  ASSERT_EQ(solver->Solve(q, Vector::Zero(q.size()), basis, y), LcpStatus::kSolved);
  EXPECT_LE(MaxAbs(y - expected), 5 * h * h);
  EXPECT_LE(Residual(M, q, y), 1e-13 * MaxAbs(q));
}

TEST(ClassifySparseTest, AgreesWithTheDenseTests) {
  LcpGenerator generator(5);
  int yes = 0, no = 0, unknown = 0;
  for (int k = 0; k < 400; ++k) {
    const Index n = generator.Integer(1, 12);
    Matrix M;
    switch (k % 8) {
      case 0:
        M = Matrix(PositiveDefinite(generator, n, k % 16 == 0));
        break;
      case 1:
        M = generator.MMatrix(n);
        break;
      case 2:
        M = generator.ZMatrix(n);
        break;
      case 3:
        M = generator.SingularMMatrix(n);
        break;
      case 4:
        M = generator.Skew(n);
        break;
      case 5:
        M = generator.BadlyScaled(generator.MMatrix(n), 3);
        break;
      case 6:
        M = Matrix(RandomPattern(generator, n, 2));
        break;
      default:
        M = generator.PositiveSemidefinite(n, (n + 1) / 2);
        break;
    }
    const MatrixClass dense = Classify(M), sparse = ClassifySparse(Sparse(M));
    EXPECT_EQ(sparse.z.answer, dense.z.answer) << M;
    EXPECT_EQ(sparse.zero, dense.zero);
    EXPECT_EQ(sparse.zero_row, dense.zero_row);
    // Never the opposite; unknown is allowed, but not for what the header promises.
    for (const auto& [ours, theirs] :
         {std::pair{sparse.p, dense.p}, std::pair{sparse.positive_semidefinite, dense.positive_semidefinite}}) {
      if (ours.answer == Answer::kUnknown) continue;
      EXPECT_EQ(ours.answer, theirs.answer) << ours.why << "\n" << M;
    }
    if (k % 8 == 1 || k % 8 == 5 || k % 8 == 0) {
      EXPECT_TRUE(sparse.p.yes()) << sparse.p.why << "\n" << M;
    }
    if (k % 8 == 1) {
      EXPECT_NEAR(*sparse.lipschitz / *dense.lipschitz, 1, 1e-10);
    }
    if (dense.lipschitz && sparse.lipschitz) {
      EXPECT_GE(*sparse.lipschitz, *dense.lipschitz * (1 - 1e-10));
    }
    yes += sparse.p.yes();
    no += sparse.p.no();
    unknown += sparse.p.answer == Answer::kUnknown;
  }
  EXPECT_GT(yes, 100);
  EXPECT_GT(no, 50);
  EXPECT_GT(unknown, 10);
}

TEST(ClassifySparseTest, IsNotFooledNextToTheBoundary) {
  // tridiag(-1, d, -1) is an M-matrix for d > 2 cos(π/(n+1)) only.
  const Index n = 2000;
  const double edge = 2 * std::cos(std::numbers::pi / static_cast<double>(n + 1));
  for (const double distance : {1e-6, 1e-9, -1e-9, -1e-6}) {
    SparseMatrix M(n, n);
    for (Index i = 0; i < n; ++i) {
      M.insert(i, i) = edge + distance;
      if (i > 0) M.insert(i, i - 1) = M.insert(i - 1, i) = -1;
    }
    M.makeCompressed();
    const MatrixClass known = ClassifySparse(M);
    EXPECT_EQ(known.p.yes(), distance > 0) << distance << " " << known.p.why;
    EXPECT_EQ(known.positive_semidefinite.yes(), distance > 0) << distance;
    if (distance < 0) {
      EXPECT_FALSE(known.p.yes()) << known.p.why;
    }
  }
}

TEST(MakeSparseLcpSolverTest, SaysWhereNoSparseSolverServes) {
  LcpGenerator generator(6);
  const SparseMatrix z = Sparse(testing::WuChenExample42());
  EXPECT_EQ(MakeSparseLcpSolver(z, Selection::kLeastElement), nullptr);
  EXPECT_EQ(MakeSparseLcpSolver(Laplacian(3), Selection::kAny), nullptr);
  EXPECT_NE(MakeSparseLcpSolver(Laplacian(3), Selection::kLeastElement), nullptr);
  EXPECT_NE(MakeSparseLcpSolver(Laplacian(3), Selection::kUnique), nullptr);
}

}  // namespace
}  // namespace dlcs
