// SPDX-License-Identifier: Apache-2.0
#include "core/driver/memory_prediction.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/discretization/step_cache.h"
#include "core/linalg/sparse/multigrid_solver.h"
#include "core/parallel/team.h"

namespace dlcs {
namespace {

constexpr double kNumber = 8;                // bytes
constexpr double kMatricesOfAStep = 12;      // of size m × m, with the work space of the matrix functions
constexpr double kColumnsOfARun = 8;         // for each node: y, q, g, the free motion, ...
constexpr double kMaxKernelDoubles = 8.4e7;  // blocks and their transforms, as core/laplace/kernel.h bounds them

// The entries of a matrix as a sparse one, without making it.
double EntriesOf(const StructuredMatrix& matrix) {
  if (matrix.is_dense()) return static_cast<double>((matrix.Dense().array() != 0).count());
  const KroneckerSum* const sum = matrix.kronecker_sum();
  if (!sum) return static_cast<double>(matrix.nonzeros());
  double entries = static_cast<double>(matrix.rows());
  for (const SparseMatrix& factor : sum->factors) {
    const auto off_diagonal = static_cast<double>(factor.nonZeros() - factor.rows());
    entries += std::max(off_diagonal, 0.0) * static_cast<double>(matrix.rows() / factor.rows());
  }
  return entries;
}

// I - hA beside a copy of A while it is made, the levels of multigrid, and vectors.
double IterativeStepBytes(const Problem& problem) {
  constexpr double kBytesOfAnEntry = 110, kVectors = 16;
  const bool is_symmetric = problem.A.kronecker_sum() || (problem.A.sparse() && IsSymmetric(*problem.A.sparse()));
  const double vectors = kVectors + (is_symmetric ? 0.0 : 2.0 * MultigridSolver::kRestart);
  const auto m = static_cast<double>(problem.num_states()), n = static_cast<double>(problem.num_constraints());
  double entries = 0;
  for (const StructuredMatrix* matrix : {&problem.A, &problem.B, &problem.N, &problem.M}) entries += EntriesOf(*matrix);
  return entries * kBytesOfAnEntry + (m + n) * vectors * kNumber;
}

// How many lengths of step have a set-up at the same time.
double LengthsKept(const Grid& grid, Index states) {
  std::vector<double> lengths;
  for (const Run& run : grid.runs) lengths.push_back(run.step);
  std::sort(lengths.begin(), lengths.end());
  lengths.erase(std::unique(lengths.begin(), lengths.end(), IsSameStep), lengths.end());
  return static_cast<double>(std::clamp(lengths.size(), std::size_t{1}, MostStepsKept(states)));
}

}  // namespace

double SparseStepBytes(const Problem& problem, double factor_nonzeros) {
  constexpr double kCouplings = 4;        // K_0, M + K_0, and what its LCPs keep
  constexpr double kZerosOfPanels = 1.3;  // and row numbers
  const auto m = static_cast<double>(problem.num_states()), n = static_cast<double>(problem.num_constraints());
  const bool is_symmetric = IsSymmetric(problem.A.Sparse()) && IsSymmetric(problem.E.Sparse());
  // A solve reads L and U, which of a symmetric matrix are one.
  const double of_a_solve = 2 * factor_nonzeros * kNumber * kZerosOfPanels;
  const double factors = is_symmetric ? of_a_solve / 2 : of_a_solve;
  // What is kept of the pairs is read in each step, and takes no more than a solve reads.
  const double response = std::min(m * n, static_cast<double>(StructuredMatrix::kMaxDenseEntries)) * kNumber;
  return kCouplings * n * n * kNumber + factors + std::min(response, of_a_solve);
}

double PredictBytes(const Problem& problem, const Grid& grid, Method method, const PropagatorChoice& propagator) {
  const double m = static_cast<double>(problem.num_states()), n = static_cast<double>(problem.num_constraints());
  const double steps = static_cast<double>(grid.num_steps());
  const double outputs = static_cast<double>(grid.output_nodes.size());
  const double psi = static_cast<double>(problem.f.inner_size(problem.num_states()));
  const double trajectory = ((m + 2 * n + 2) * outputs + steps + 1) * kNumber;  // with the grid
  const double couplings = 4 * n * n * kNumber;
  const double kernel =
      method == Method::kLaplaceIteration ? std::min(5 * n * n * steps, kMaxKernelDoubles) * kNumber : 0;
  const double run_columns = (kColumnsOfARun * n + 2 * psi) * steps * kNumber;
  // Steps on states keep blocks of some steps: at most 16 MB for each matrix, with sparse factors 4 MB.
  const double most = propagator.record.used == PropagatorKind::kSparseStepping ? 5e5 : 2e6;
  const double stretch = kColumnsOfARun * std::min(m * steps, std::max(m, most)) * kNumber;
  switch (propagator.record.used) {
    case PropagatorKind::kAuto:
    case PropagatorKind::kDense:
      return trajectory + couplings + kernel + kMatricesOfAStep * m * m * kNumber +
             (method == Method::kWuChenIteration ? kColumnsOfARun * m * steps * kNumber : stretch);
    case PropagatorKind::kSparseStepping: {
      const Index nonzeros = problem.A.Sparse().nonZeros() + problem.E.Sparse().nonZeros();
      const double in_the_plane = static_cast<double>(nonzeros) * std::max(1.0, std::log2(m));
      return trajectory + stretch +
             LengthsKept(grid, problem.num_states()) *
                 SparseStepBytes(problem, propagator.factor_nonzeros > 0 ? propagator.factor_nonzeros : in_the_plane);
    }
    case PropagatorKind::kIterativeStepping: {
      Team& team = Team::Current();
      const double processes = team.distributed_steps() ? team.size() : 1;
      // Blocks have eight steps at least.
      const double shared = LengthsKept(grid, problem.num_states()) * IterativeStepBytes(problem) +
                            kColumnsOfARun * std::min(m * steps, std::max(8 * m, 2e6)) * kNumber;
      return trajectory + shared / processes;
    }
    case PropagatorKind::kKroneckerSum:
    case PropagatorKind::kContour:
      return trajectory + couplings + kernel + run_columns + kColumnsOfARun * m * kNumber +
             propagator.system->PredictBytes(grid);
  }
  return trajectory;
}

}  // namespace dlcs
