// SPDX-License-Identifier: Apache-2.0
// Krylov methods for rows that are distributed over the ranks, with algebraic multigrid.

#ifndef DLCS_CORE_MPI_DISTRIBUTED_KRYLOV_H_
#define DLCS_CORE_MPI_DISTRIBUTED_KRYLOV_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "core/linalg/sparse/krylov_solver.h"
#include "core/mpi/halo.h"
#include "core/mpi/mpi_team.h"
#include "core/mpi/multigrid_cycle.h"
#include "core/mpi/ownership.h"

namespace dlcs {

// The preconditioner is one V-cycle (core/mpi/multigrid_cycle.h), made anew whenever other unknowns are fixed: rows and
// columns of fixed unknowns are those of a diagonal matrix in it. The bits depend on the number of ranks and on nothing
// else.
class DistributedKrylov final : public KrylovSolver {
 public:
  // `unknowns` distributes rows and columns of K.
  DistributedKrylov(const DistributedRows& K, const Ownership& unknowns, bool is_symmetric, Workers& workers,
                    MpiTeam& team);

  void Expand(const Vector& x) override;

 private:
  void Precondition(const Vector& r, double size, Vector& z) override;
  void PrepareFixed(const std::vector<std::uint8_t>& is_fixed) override;

  MpiTeam& mpi_;
  const Halo halo_;
  // Numbers in the cycle, consecutive in each rank: of the first own unknown, and of those of the halo.
  Index first_number_ = 0;
  std::vector<Index> outside_numbers_;
  std::vector<std::uint8_t> fixed_in_cycle_;
  Matrix expanded_;
  std::unique_ptr<MultigridCycle> cycle_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_DISTRIBUTED_KRYLOV_H_
