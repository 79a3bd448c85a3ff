// SPDX-License-Identifier: Apache-2.0
// Krylov methods for rows that are distributed over the ranks, with the algebraic multigrid of hypre.

#ifndef DLCS_CORE_MPI_HYPRE_SOLVER_H_
#define DLCS_CORE_MPI_HYPRE_SOLVER_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "core/linalg/sparse/krylov_solver.h"
#include "core/mpi/halo.h"
#include "core/mpi/mpi_team.h"
#include "core/mpi/ownership.h"

namespace dlcs {

// To be called after MPI_Init and before MPI_Finalize.
void StartHypre();
void EndHypre();

// The preconditioner is one V-cycle of BoomerAMG, made anew whenever other unknowns are fixed: rows and columns of
// fixed unknowns are those of a diagonal matrix in it. For a symmetric K it smooths by Chebyshev polynomials and
// coarsens by PMIS, neither of which sees where one rank ends and the next begins: the number of iterations then does
// not depend on the number of ranks. Otherwise parameters are hypre's defaults, and for a K that is not symmetric l1
// Gauss-Seidel and HMIS are among them. The bits depend on the number of ranks and on nothing else.
class HypreSolver final : public KrylovSolver {
 public:
  // `unknowns` distributes rows and columns of K.
  HypreSolver(const DistributedRows& K, const Ownership& unknowns, bool is_symmetric, Workers& workers, MpiTeam& team);
  ~HypreSolver() override;

  void Expand(const Vector& x) override;

 private:
  struct Cycle;

  void Precondition(const Vector& r, double size, Vector& z) override;
  void PrepareFixed(const std::vector<std::uint8_t>& is_fixed) override;

  MpiTeam& mpi_;
  const Halo halo_;
  // Numbers of hypre, consecutive in each rank: of the first own unknown, and of those of the halo.
  Index first_number_ = 0;
  std::vector<Index> outside_numbers_;
  std::vector<std::uint8_t> fixed_in_cycle_;
  Matrix expanded_;
  std::unique_ptr<Cycle> cycle_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_HYPRE_SOLVER_H_
