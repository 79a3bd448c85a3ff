// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/multigrid_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>
#include <vector>

#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// I + stiffness (-Δ + speed · upwind differences along each axis), of unit cells, on `side`^dimensions points.
struct Grid {
  Index side = 20;
  int dimensions = 2;
  double stiffness = 100;
  double speed = 0;
  double shift = 1;
};

SparseMatrix MatrixOf(const Grid& grid) {
  Index size = 1;
  for (int d = 0; d < grid.dimensions; ++d) size *= grid.side;
  std::vector<Eigen::Triplet<double>> entries;
  for (Index i = 0; i < size; ++i) {
    entries.emplace_back(i, i, grid.shift + grid.stiffness * grid.dimensions * (2 + grid.speed));
    for (Index stride = 1; stride < size; stride *= grid.side) {
      const Index at = i / stride % grid.side;
      if (at > 0) entries.emplace_back(i, i - stride, -grid.stiffness * (1 + grid.speed));
      if (at + 1 < grid.side) entries.emplace_back(i, i + stride, -grid.stiffness);
    }
  }
  SparseMatrix K(size, size);
  K.setFromTriplets(entries.begin(), entries.end());
  return K;
}

Vector RightHandSide(Index size) {
  Vector b(size);
  for (Index i = 0; i < size; ++i) b[i] = std::sin(0.1 * double(i)) + std::fmod(0.618 * double(i), 1.0);
  return b;
}

constexpr double kTarget = 1e-10;

// Steps until the residual is 1e-10, checked.
Index IterationsFor(const Grid& grid) {
  Workers workers(1);
  const SparseMatrix K = MatrixOf(grid);
  MultigridSolver solver(K, workers);
  const Vector b = RightHandSide(K.rows());
  Vector x = Vector::Zero(K.rows());
  solver.Start(b, x, {.split = K.rows()});
  EXPECT_TRUE(solver.Reduce(kTarget, 100));
  EXPECT_LE(MaxAbs(b - K * x), 2 * kTarget);
  if (solver.multigrid()) {
    EXPECT_LE(solver.multigrid()->complexity(), 2.2);
  }
  return solver.iterations();
}

TEST(MultigridSolverTest, NeedsNoMoreIterationsOnFinerGrids) {
  for (const double stiffness : {5.0, 100.0, 1e4}) {
    EXPECT_LE(IterationsFor({.side = 40, .stiffness = stiffness}), 24);
    EXPECT_LE(IterationsFor({.side = 320, .stiffness = stiffness}), 30);
    EXPECT_LE(IterationsFor({.side = 12, .dimensions = 3, .stiffness = stiffness}), 18);
    EXPECT_LE(IterationsFor({.side = 48, .dimensions = 3, .stiffness = stiffness}), 24);
  }
}

TEST(MultigridSolverTest, NeedsFewIterationsWithConvection) {
  for (const double speed : {0.5, 2.0}) {
    EXPECT_LE(IterationsFor({.side = 40, .speed = speed}), 30);
    EXPECT_LE(IterationsFor({.side = 160, .speed = speed}), 40);
    EXPECT_LE(IterationsFor({.side = 32, .dimensions = 3, .speed = speed}), 30);
  }
}

TEST(MultigridSolverTest, HasNoLevelsWhereTheIdentityDominates) {
  EXPECT_LE(IterationsFor({.side = 100, .stiffness = 0.01, .speed = 1}), 8);
}

// In the plane ρ = 4 s / (1 + 4 s) of a large grid, in space 6 s / (1 + 6 s): 0.95 for s = 4.75 and 3.17.
TEST(MultigridSolverTest, TakesTheDiagonalWhereItDominates) {
  Workers workers(1);
  const auto takes_diagonal = [&](const Grid& grid) { return !MultigridSolver(MatrixOf(grid), workers).multigrid(); };
  EXPECT_TRUE(takes_diagonal({.side = 300, .stiffness = 4.7}));
  EXPECT_FALSE(takes_diagonal({.side = 300, .stiffness = 4.8}));
  EXPECT_TRUE(takes_diagonal({.side = 40, .dimensions = 3, .stiffness = 3.1}));
  EXPECT_FALSE(takes_diagonal({.side = 40, .dimensions = 3, .stiffness = 3.3}));
  EXPECT_FALSE(takes_diagonal({.stiffness = 1, .shift = -1}));
  EXPECT_FALSE(takes_diagonal({.stiffness = 0.01, .speed = 1}));  // not symmetric
  for (const Index side : {40, 320}) {
    EXPECT_LE(IterationsFor({.side = side, .stiffness = 0.01}), 8);
    EXPECT_LE(IterationsFor({.side = side, .stiffness = 1}), 40);
    EXPECT_LE(IterationsFor({.side = side, .stiffness = 4.7}), 90);
  }
}

// Rows and columns in other units: the spectral radius does not change.
TEST(MultigridSolverTest, TakesTheDiagonalInAnyUnits) {
  const SparseMatrix K = MatrixOf({.side = 40, .stiffness = 4.7});
  Vector units(K.rows());
  for (Index i = 0; i < K.rows(); ++i) units[i] = std::ldexp(1.0, static_cast<int>(i % 7) - 3);
  Workers workers(1);
  EXPECT_FALSE(MultigridSolver(SparseMatrix(units.asDiagonal() * K * units.asDiagonal()), workers).multigrid());
}

TEST(MultigridSolverTest, HasTheSameBitsForAnyNumberOfThreads) {
  for (const Grid& grid : {Grid{.side = 30, .dimensions = 3}, Grid{.side = 30, .dimensions = 3, .speed = 1},
                           Grid{.side = 30, .dimensions = 3, .stiffness = 1}}) {
    const SparseMatrix K = MatrixOf(grid);
    const Vector b = RightHandSide(K.rows());
    std::vector<Vector> solutions;
    for (const int threads : {1, 2}) {
      Workers workers(threads);
      MultigridSolver solver(K, workers);
      Vector& x = solutions.emplace_back(Vector::Zero(K.rows()));
      solver.Start(b, x, {.split = K.rows()});
      EXPECT_TRUE(solver.Reduce(kTarget, 100));
    }
    EXPECT_EQ(solutions[0], solutions[1]);
  }
}

TEST(MultigridSolverTest, SolvesBesideFixedUnknownsWhateverWasFixedBefore) {
  const Grid grid{.side = 24, .dimensions = 3};
  const SparseMatrix K = MatrixOf(grid);
  const Vector b = RightHandSide(K.rows());
  Workers workers(1);
  std::vector<std::uint8_t> is_fixed(K.rows(), 0), others(K.rows(), 0);
  for (Index i = 0; i < K.rows(); ++i) {
    is_fixed[i] = i % grid.side < 2 && i / grid.side % grid.side < 11;  // a part of a wall
    others[i] = i % 3 == 0;
  }
  std::vector<Vector> solutions;
  for (const bool has_past : {false, true}) {
    MultigridSolver solver(K, workers);
    if (has_past) solver.Fix(others);
    solver.Fix(is_fixed);
    Vector& x = solutions.emplace_back(Vector::Constant(K.rows(), 0.5));
    solver.Start(b, x, {.split = K.rows()});
    EXPECT_TRUE(solver.Reduce(kTarget, 100));
    EXPECT_LE(solver.iterations(), 18);
    const Vector residual = b - K * x;
    for (Index i = 0; i < K.rows(); ++i) {
      if (is_fixed[i]) {
        EXPECT_EQ(x[i], 0.5);
      } else {
        EXPECT_LE(std::abs(residual[i]), 2 * kTarget);
      }
    }
  }
  EXPECT_EQ(solutions[0], solutions[1]);
}

TEST(MultigridSolverTest, StopsOnRequest) {
  const SparseMatrix K = MatrixOf({.side = 100});
  const Vector b = RightHandSide(K.rows());
  Vector x = Vector::Zero(K.rows());
  Workers workers(2);
  std::stop_source stop;
  const StopScope scope(stop.get_token());
  MultigridSolver solver(K, workers);
  solver.Start(b, x, {.split = K.rows()});
  stop.request_stop();
  EXPECT_THROW(solver.Reduce(kTarget, 100), Stopped);
  EXPECT_THROW(MultigridSolver(K, workers), Stopped);
}

// Without the identity and with what a point loses to the boundary added back, constants are in the kernel of K, and b
// is not in its range.
TEST(MultigridSolverTest, DoesNotClaimToSolveASingularSystem) {
  SparseMatrix K = MatrixOf({.side = 40, .shift = 0});
  for (Index j = 0; j < K.cols(); ++j) K.coeffRef(j, j) -= K.col(j).sum();
  const Vector b = RightHandSide(K.rows());
  Vector x = Vector::Zero(K.rows());
  Workers workers(1);
  MultigridSolver solver(K, workers);
  solver.Start(b, x, {.split = K.rows()});
  EXPECT_FALSE(solver.Reduce(kTarget, 200));
}

TEST(MultigridSolverTest, SaysWhatIsTrueOfAnIndefiniteSystem) {
  for (const double speed : {0.0, 1.0}) {
    const SparseMatrix K = MatrixOf({.side = 40, .speed = speed, .shift = -30});
    const Vector b = RightHandSide(K.rows());
    Vector x = Vector::Zero(K.rows());
    Workers workers(1);
    MultigridSolver solver(K, workers);
    solver.Start(b, x, {.split = K.rows()});
    const bool is_solved = solver.Reduce(1e-8, 200);
    solver.Refresh();
    EXPECT_EQ(is_solved, MaxAbs(b - K * x) <= 2e-8);
  }
}

}  // namespace
}  // namespace dlcs
