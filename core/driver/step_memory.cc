// SPDX-License-Identifier: Apache-2.0
#include "core/driver/step_memory.h"

#include <algorithm>

#include "core/linalg/sparse/multigrid_solver.h"
#include "core/linalg/structured_matrix.h"

namespace dlcs {
namespace {

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

}  // namespace

double SparseStepBytes(const Problem& problem, double factor_nonzeros) {
  constexpr int kCouplings = 4;           // K_0, M + K_0, and what its LCPs keep
  constexpr double kZerosOfPanels = 1.3;  // and row numbers
  const auto m = static_cast<double>(problem.num_states()), n = static_cast<double>(problem.num_constraints());
  const bool is_symmetric = IsSymmetric(problem.A.Sparse()) && IsSymmetric(problem.E.Sparse());
  // A solve reads L and U, which of a symmetric matrix are one.
  const double of_a_solve = 2 * factor_nonzeros * sizeof(double) * kZerosOfPanels;
  const double factors = is_symmetric ? of_a_solve / 2 : of_a_solve;
  // What is kept of the pairs is read in each step, and takes no more than a solve reads.
  const double response = std::min(m * n, static_cast<double>(StructuredMatrix::kMaxDenseEntries)) * sizeof(double);
  return kCouplings * n * n * sizeof(double) + factors + std::min(response, of_a_solve);
}

double IterativeStepBytes(const Problem& problem) {
  constexpr int kBytesOfAnEntry = 110, kVectors = 16;
  const bool is_symmetric = problem.A.kronecker_sum() || (problem.A.sparse() && IsSymmetric(*problem.A.sparse()));
  const double vectors = kVectors + (is_symmetric ? 0.0 : 2.0 * MultigridSolver::kRestart);
  const auto m = static_cast<double>(problem.num_states()), n = static_cast<double>(problem.num_constraints());
  double entries = 0;
  for (const StructuredMatrix* matrix : {&problem.A, &problem.B, &problem.N, &problem.M}) entries += EntriesOf(*matrix);
  return entries * kBytesOfAnEntry + (m + n) * vectors * sizeof(double);
}

}  // namespace dlcs
