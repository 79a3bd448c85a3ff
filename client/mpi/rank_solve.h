// SPDX-License-Identifier: Apache-2.0
// `dlcs solve` of which every rank reads, keeps and writes its rows.

#ifndef DLCS_CLIENT_MPI_RANK_SOLVE_H_
#define DLCS_CLIENT_MPI_RANK_SOLVE_H_

#include "client/cli/commands/solve_ways.h"
#include "core/mpi/mpi_team.h"

namespace dlcs::client {

// The ways of a solve on all ranks, which call this together.
//
// Where the command names iterative steps, which ranks share by rows, A, B and N in files of Matrix Market or PETSc are
// read by rows (client/mpi/row_files.h). If the steps are given too, the error is not estimated and the result goes to
// a file of HDF5, the trajectory stays with the ranks, and they write it together. Everything else is read by every
// rank, and written by the first one.
SolveWays WaysOfRanks(const SolveCommand& command, MpiTeam& team);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_MPI_RANK_SOLVE_H_
