// SPDX-License-Identifier: Apache-2.0
// Finds a sector that contains the spectrum of a matrix whose rows are distributed over ranks.

#ifndef DLCS_CORE_MPI_DISTRIBUTED_SECTOR_H_
#define DLCS_CORE_MPI_DISTRIBUTED_SECTOR_H_

#include <optional>

#include "core/linalg/sparse/row_writer.h"
#include "core/mpi/mpi_team.h"
#include "core/mpi/ownership.h"
#include "core/parallel/parallel.h"
#include "core/propagator/sector.h"

namespace dlcs {

// FindSector() without a factorization. A Hermitian matrix H = (h_ij) with positive diagonal is positive semidefinite
// if there is a v > 0 with
//
//     h_ii v_i >= Σ_{j≠i} |h_ij| v_j     for all i,
//
// and for the two half-planes of a sector, H = σE - S ± i cot(α) K, these are the same inequalities. v = 1 is tried
// first, and then the solution of C v = 1 for the symmetric matrix C of the inequalities, by conjugate gradients. It is
// sufficient only: it fails for some matrices that FindSector() serves, as those with large positive entries off the
// diagonal.
//
// `A`, `transposed`, `E`: the rows of this rank, with all columns; `E` with 0 rows stands for the identity. Called by
// all ranks of `team`, with the same result. Cost: at most some ten solves with multigrid.
std::optional<Sector> FindDistributedSector(const RowMajorMatrix& A, const RowMajorMatrix& transposed,
                                            const RowMajorMatrix& E, double horizon, const Ownership& rows,
                                            Workers& workers, MpiTeam& team);

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_DISTRIBUTED_SECTOR_H_
