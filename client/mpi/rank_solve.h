// SPDX-License-Identifier: Apache-2.0
// `dlcs solve` where every rank reads, stores and writes its own rows.

#ifndef DLCS_CLIENT_MPI_RANK_SOLVE_H_
#define DLCS_CLIENT_MPI_RANK_SOLVE_H_

#include "absl/status/statusor.h"
#include "client/cli/commands/solve_hooks.h"
#include "core/mpi/solving_team.h"

namespace dlcs::client {

// The hooks of a solve on all ranks. Called by all ranks.
//
// A, B and N in Matrix Market or PETSc files are read by rows (client/mpi/row_files.h) if the command requests
// iterative steps, whose rows all ranks share, or a contour with groups of ranks, each of which shares the rows. If
// iterative steps are requested and given, the error is not estimated and the result is an HDF5 file, the trajectory
// remains distributed, and all ranks write it together. Everything else is read by every rank, and written by the first
// one. Ranks that read different problems refuse to solve them.
//
// Errors: InvalidArgument, on all ranks, if they have different options.
absl::StatusOr<SolveHooks> HooksForRanks(const SolveCommand& command, SolvingTeam& team);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_MPI_RANK_SOLVE_H_
