// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/kronecker_system.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <unsupported/Eigen/KroneckerProduct>

#include "core/discretization/scheme.h"
#include "core/linalg/norms.h"
#include "core/models/signorini.h"

namespace dlcs {
namespace {

using std::numbers::pi;

SparseMatrix Tridiagonal(Index size, double diagonal, double beside) {
  Matrix dense = diagonal * Matrix::Identity(size, size);
  dense.diagonal(1).setConstant(beside);
  dense.diagonal(-1).setConstant(beside);
  return dense.sparseView();
}

SparseMatrix RandomSymmetric(Index size, double shift) {
  const Matrix R = Matrix::Random(size, size);
  return Matrix(R + R.transpose() - shift * Matrix::Identity(size, size)).sparseView();
}

// A problem on a grid with walls of several points along `axis`.
Problem OnGrid(const std::vector<SparseMatrix>& factors, std::size_t axis) {
  Problem problem;
  const KroneckerSum sum{factors};
  Matrix b = Matrix::Ones(1, 1), n = b;
  for (std::size_t k = 0; k < factors.size(); ++k) {
    const Index size = factors[k].rows();
    const Matrix of_b = k == axis ? Matrix(Vector::Random(size)) : Matrix(Matrix::Random(size, size));
    const Matrix of_n = k == axis ? Matrix(Vector::Random(size)) : Matrix(Matrix::Random(size, size));
    b = Matrix(Eigen::kroneckerProduct(b, of_b));
    n = Matrix(Eigen::kroneckerProduct(n, of_n));
  }
  problem.A = sum;
  problem.B = SparseMatrix(b.sparseView());
  problem.N = SparseMatrix(n.transpose().sparseView());
  problem.M = Matrix::Identity(b.cols(), b.cols());
  problem.f = TimeFunction::Zero(sum.size());
  problem.g = TimeFunction::Zero(b.cols());
  problem.x0 = Vector::Random(sum.size());
  problem.horizon = 1;
  return problem;
}

// The run of the dense scheme: N x and x at nodes, N x in the middles.
struct DenseRun {
  Matrix x, q, q_middle;
};
DenseRun RunDense(const Problem& problem, const Scheme& scheme, const Matrix& f, const Matrix& y) {
  const Index steps = f.cols() - 1;
  DenseRun run{Matrix(problem.num_states(), steps + 1), {}, Matrix(problem.num_constraints(), steps)};
  run.x.col(0) = problem.x0;
  for (Index j = 1; j <= steps; ++j) {
    run.x.col(j) = scheme.state * run.x.col(j - 1) + scheme.y_after * y.col(j) + scheme.f_before * f.col(j - 1) +
                   scheme.f_after * f.col(j);
    Vector middle = scheme.mid_state * run.x.col(j - 1) + scheme.mid_y_after * y.col(j) +
                    scheme.mid_f_before * f.col(j - 1) + scheme.mid_f_after * f.col(j);
    if (scheme.y_before.size() > 0) {
      run.x.col(j) += scheme.y_before * y.col(j - 1);
      middle += scheme.mid_y_before * y.col(j - 1);
    }
    run.q_middle.col(j - 1) = problem.N * middle;
  }
  run.q = problem.N * run.x;
  return run;
}

// Everything that a propagator gives, against dense matrices.
void ExpectDenseMotion(const Problem& problem, const Matrix& psi, double step) {
  std::string why_not;
  const auto system = KroneckerSystem::Create(problem, why_not);
  ASSERT_TRUE(system) << why_not;
  const Index steps = psi.cols() - 1, n = problem.num_constraints();
  const Matrix f = problem.f.is_lifted() ? problem.f.lift * psi : psi;
  const Matrix y = Matrix::Random(n, steps + 1);
  Workers workers(2);
  for (const Hold hold : {Hold::kLinear, Hold::kConstant}) {
    const Scheme scheme =
        hold == Hold::kLinear ? ExponentialPiecewiseLinear(problem, step) : ExponentialPiecewiseConstant(problem, step);
    const DenseRun dense = RunDense(problem, scheme, f, y);
    const double size = MaxAbs(dense.q), tolerance = 1e-12 * size;
    const auto kernel = system->MakeKernel(step, hold, steps, workers, {});
    const FreeMotion free = system->Move(problem.x0, {step, psi}, hold, workers, {});
    EXPECT_LE(MaxAbs(kernel->K0() - problem.N.Dense() * scheme.y_after), 1e-12 * MaxAbs(kernel->K0()));

    // Marched.
    const auto memory = kernel->Start(y.col(0));
    Matrix q = free.nodes;
    Vector past(n);
    for (Index j = 1; j <= steps; ++j) {
      memory->Next(past);
      q.col(j) += past + kernel->K0() * y.col(j);
      memory->Push(y.col(j));
    }
    EXPECT_LE(MaxAbs(q - dense.q), tolerance);

    // At once, after a history of three steps.
    const auto later = kernel->Start(y.col(0));
    for (Index j = 1; j <= 3; ++j) later->Push(y.col(j));
    const Matrix whole =
        free.nodes.rightCols(steps - 3) + later->History(steps - 3) + kernel->Respond(y.rightCols(steps - 3), workers);
    EXPECT_LE(MaxAbs(whole - dense.q.rightCols(steps - 3)), tolerance);

    const Motion motion = kernel->MoveThroughout(free, y, workers);
    EXPECT_LE(MaxAbs(motion.nodes - dense.q.rightCols(steps)), tolerance);
    EXPECT_LE(MaxAbs(motion.middles - dense.q_middle), tolerance);
    const Motion stopped = kernel->MoveThroughout(free, y.leftCols(steps - 1), workers);
    EXPECT_EQ(stopped.nodes, motion.nodes.leftCols(steps - 2));
    EXPECT_EQ(stopped.middles, motion.middles.leftCols(steps - 2));
    const Motion at_rest = kernel->MoveThroughout(free, Matrix::Zero(n, steps + 1), workers);
    EXPECT_LE(MaxAbs(motion.middles - at_rest.middles - kernel->RespondAtMiddles(y, workers)), tolerance);

    const std::vector<Index> nodes{1, 2, steps / 2, steps};
    const Matrix states = system->States(problem.x0, {step, psi}, y, hold, nodes, workers, {});
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      EXPECT_LE(MaxAbs(states.col(static_cast<Index>(k)) - dense.x.col(nodes[k])), 1e-12 * MaxAbs(dense.x));
    }
    for (const Index window : {1, 2, 10, 3}) {
      const double bound = kernel->Bound(window);
      Matrix hats = Matrix::Zero(n, steps);
      hats.col(0).setOnes();
      const Matrix response = kernel->Respond(hats, workers).leftCols(window) / step;
      EXPECT_GE(bound * (1 + 1e-12), MaxAbs(response));
    }
  }
}

TEST(KroneckerSystemTest, MovesAsDenseMatricesDo) {
  std::srand(11);
  const std::vector<std::vector<SparseMatrix>> grids{
      {Tridiagonal(7, -200, 100), Tridiagonal(9, -200, 100)},  // sine transforms, stiff
      {RandomSymmetric(4, 8), RandomSymmetric(6, 8)},
      {RandomSymmetric(4, 0), RandomSymmetric(5, 0)},  // unstable
      {Tridiagonal(3, -2, 1), RandomSymmetric(3, 5), Tridiagonal(4, -2, 1)},
      {Tridiagonal(12, -2, 1)},
  };
  for (const auto& factors : grids) {
    for (std::size_t axis = 0; axis < factors.size(); ++axis) {
      Problem problem = OnGrid(factors, axis);
      SCOPED_TRACE(problem.A.Describe() + ", axis " + std::to_string(axis));
      ExpectDenseMotion(problem, Matrix::Zero(problem.num_states(), 21), 0.05);
      // Sources as those of a wall, and any others.
      problem.f = TimeFunction::Formulas(std::vector<std::string>(problem.num_constraints(), "t"));
      problem.f.lift = SparseMatrix(problem.B.Sparse() * 3);
      ExpectDenseMotion(problem, Matrix::Random(problem.num_constraints(), 21), 0.05);
      problem.f.lift = Matrix(Matrix::Random(problem.num_states(), problem.num_constraints()));
      ExpectDenseMotion(problem, Matrix::Random(problem.num_constraints(), 21), 0.05);
    }
  }
}

TEST(KroneckerSystemTest, ServesTheSignoriniProblemWithFewTerms) {
  auto problem = MakeSignoriniProblem({.cells = 16, .coefficient = 2e-2, .horizon = 1});
  ASSERT_TRUE(problem.ok());
  std::string why_not;
  const auto system = KroneckerSystem::Create(*problem, why_not);
  ASSERT_TRUE(system) << why_not;
  EXPECT_LT(system->record().terms, 15);
  EXPECT_LE(system->record().error, 1e-13);
  ExpectDenseMotion(*problem, Matrix::Random(15, 31), 0.01);
}

TEST(KroneckerSystemTest, SystemsOfTheSameMatricesShareModesAndKernels) {
  SetupCache setups(1e8);
  std::string why_not;
  Workers workers(1);
  const auto problem = MakeSignoriniProblem({.cells = 16, .coefficient = 2e-2, .horizon = 1});
  ASSERT_TRUE(problem.ok());
  const auto kernel_of = [&](const Problem& of) {
    return KroneckerSystem::Create(of, why_not, &setups)->MakeKernel(0.01, Hold::kLinear, 1, workers, {});
  };
  const auto first = kernel_of(*problem);
  Problem other = *problem;
  other.x0 *= 2;
  other.horizon = 3;
  EXPECT_EQ(kernel_of(other), first);
  EXPECT_EQ(setups.statistics().misses, 2);
  EXPECT_EQ(setups.statistics().hits, 2);
  other.N = StructuredMatrix(SparseMatrix(2 * problem->N.Sparse()));
  EXPECT_NE(kernel_of(other), first);
  EXPECT_GT(setups.statistics().bytes, 8.0 * static_cast<double>(first->K0().size()));
}

TEST(KroneckerSystemTest, SaysWhyNot) {
  std::srand(5);
  const std::vector<SparseMatrix> grid{Tridiagonal(3, -2, 1), Tridiagonal(4, -2, 1)};
  std::string why_not;
  Problem problem = OnGrid(grid, 1);
  problem.A = problem.A.Sparse();
  EXPECT_FALSE(KroneckerSystem::Create(problem, why_not));
  EXPECT_NE(why_not.find("not a Kronecker sum"), std::string::npos) << why_not;
  problem = OnGrid(grid, 1);
  problem.B = Matrix(Matrix::Random(12, 3));
  EXPECT_FALSE(KroneckerSystem::Create(problem, why_not));
  EXPECT_NE(why_not.find("one vector"), std::string::npos) << why_not;
  SparseMatrix slanted = grid[0];
  slanted.coeffRef(0, 1) = 7;
  problem = OnGrid({slanted, grid[1]}, 1);
  EXPECT_FALSE(KroneckerSystem::Create(problem, why_not));
  EXPECT_EQ(why_not, "factor 0 of A is not symmetric");
}

// λ_k and sin(jkπ/N): the transform is its own inverse and diagonalizes.
TEST(FactorTransformTest, DiagonalizesWhateverTheLength) {
  std::srand(3);
  for (const Index size : {2, 3, 5, 7, 9, 11, 12, 15, 29, 63, 96, 255}) {
    for (const SparseMatrix& factor : {Tridiagonal(size, -3, 0.5), RandomSymmetric(size, 1)}) {
      const auto transform = FactorTransform::Create(factor);
      ASSERT_TRUE(transform);
      const Matrix X = Matrix::Random(size, 3);
      const Matrix forward = transform->Forward(X);
      const double tolerance = 1e-14 * static_cast<double>(size);
      EXPECT_LE(MaxAbs(transform->Backward(forward) - X), tolerance) << size;
      EXPECT_LE(MaxAbs(transform->Forward(factor * X) - transform->eigenvalues().asDiagonal() * forward),
                tolerance * MaxAbs(transform->eigenvalues()))
          << size;
      const Vector values = Vector::Random(size);
      EXPECT_LE(MaxAbs(transform->Function(values) * X - transform->Backward(values.asDiagonal() * forward)), tolerance)
          << size;
      FactorTransform::Workspace workspace;
      Vector x = X.col(1);
      transform->ForwardInPlace(x, workspace);
      EXPECT_LE(MaxAbs(x - forward.col(1)), 1e-15 * static_cast<double>(size));
      for (const Index rows : {1, 8, 11}) {
        const Matrix by_columns = Matrix::Random(size, rows);
        Matrix by_rows = by_columns.transpose();
        transform->ForwardRows(by_rows);
        EXPECT_LE(MaxAbs(by_rows.transpose() - transform->Forward(by_columns)), tolerance) << size << ", " << rows;
        transform->BackwardRows(by_rows);
        EXPECT_LE(MaxAbs(by_rows.transpose() - by_columns), tolerance) << size << ", " << rows;
      }
    }
  }
  EXPECT_TRUE(FactorTransform::Create(Tridiagonal(255, -2, 1))->is_fast());
  EXPECT_FALSE(FactorTransform::Create(Tridiagonal(256, -2, 1))->is_fast());
}

// e^{-4 t sin²}: a sum of 255 exponentials whose rates span five decades, with few terms and everywhere in time.
TEST(SumOfExponentialsTest, ShortensTheResponseOfAWall) {
  const Index size = 255;
  SumOfExponentials sum{Vector(size), Vector(size)};
  for (Index k = 0; k < size; ++k) {
    const double angle = pi * static_cast<double>(k + 1) / (size + 1);
    sum.rates[k] = -4e4 * std::pow(std::sin(angle / 2), 2);
    sum.weights[k] = std::pow(std::sin(angle), 2);
  }
  const SumOfExponentials few = Compress(sum, 1e-13);
  EXPECT_LE(few.rates.size(), 30);
  EXPECT_LE(few.error, 1e-13);
  // What counts is its response to hats, ∫ over steps of any length.
  const auto response = [](const SumOfExponentials& of, double t) {
    return (of.weights.array() * ((of.rates.array() * t).exp() - 1) / of.rates.array()).sum();
  };
  const double whole = response(sum, 1e9);
  for (double t = 1e-9; t < 10; t *= 3) EXPECT_LE(std::abs(response(few, t) - response(sum, t)), 3e-13 * whole) << t;
}

TEST(SumOfExponentialsTest, KeepsWhatItCannotShorten) {
  const SumOfExponentials unstable{Vector{{1, -2}}, Vector{{1, 1}}};
  EXPECT_EQ(Compress(unstable, 1e-3).rates, unstable.rates);
  const SumOfExponentials mixed{Vector{{-1, -2, -3}}, Vector{{1, -1, 0}}};
  EXPECT_EQ(Compress(mixed, 1e-3).rates.size(), 2);
  const ExponentialBasis all = ChooseBasis(Vector{{0.5, -1}});
  EXPECT_EQ(all.kept.size(), 2u);
}

TEST(SumOfExponentialsTest, AFewExponentialsSpanTheOthers) {
  Vector rates(200);
  for (Index k = 0; k < 200; ++k) rates[k] = -std::pow(10.0, -1 + 5 * static_cast<double>(k) / 199);
  const ExponentialBasis basis = ChooseBasis(rates);
  EXPECT_LE(basis.kept.size(), 100u);
  for (double t = 1e-6; t < 100; t *= 1.7) {
    const Vector kept = (rates(basis.kept) * t).array().exp();
    EXPECT_LE(MaxAbs(basis.weights * kept - (rates * t).array().exp().matrix()), 1e-12) << t;
  }
}

}  // namespace
}  // namespace dlcs
