// SPDX-License-Identifier: Apache-2.0
// Algebraic multigrid for rows that are distributed over the ranks: that of hypre, or of PETSc.

#ifndef DLCS_CORE_MPI_MULTIGRID_CYCLE_H_
#define DLCS_CORE_MPI_MULTIGRID_CYCLE_H_

#include <mpi.h>

#include <memory>
#include <vector>

#include "core/types.h"

namespace dlcs {

// The rows of one rank, with consecutive numbers. Columns are those of all ranks, in any order.
struct NumberedRows {
  std::vector<int> numbers, lengths, columns;
  std::vector<double> values;
};

// One V-cycle as a preconditioner. The bits depend on the number of ranks and on nothing else. CMake chooses the
// library (DLCS_MPI_MULTIGRID). Errors of the library throw std::runtime_error.
class MultigridCycle {
 public:
  // All ranks of `communicator` together. Cost: that of the library's set-up.
  static std::unique_ptr<MultigridCycle> Make(MPI_Comm communicator, const NumberedRows& rows, bool is_symmetric);
  virtual ~MultigridCycle() = default;

  // Sets z to the result of a cycle for the right-hand side r, from zero; the rows of this rank.
  virtual void Apply(const Vector& r, Vector& z) = 0;

  // To be called after MPI_Init() and before MPI_Finalize().
  static void StartLibrary();
  static void EndLibrary();
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_MULTIGRID_CYCLE_H_
