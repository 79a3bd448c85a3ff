// SPDX-License-Identifier: Apache-2.0
// Ranks that a worker of dlcsd has started: they solve for it, and the first one tells it.

#ifndef DLCS_CLIENT_MPI_ATTEND_H_
#define DLCS_CLIENT_MPI_ATTEND_H_

#include <string>

#include "core/mpi/mpi_world.h"

namespace dlcs::client {

// On all ranks, as their team. The first one connects to the worker that the environment names
// (server/solve_jobs/rank_launcher.h), gets the work, which the others have from it, and sends events, checkpoints and
// the end. Where the world is not the one that was meant, `refusal` says why, and goes to the worker.
//
// A request of the worker to stop is agreed on by all ranks. If the worker is gone, they stop, and end some seconds
// later where they have not. Returns the exit code: not 0 without a worker, and for errors of the solve.
int Attend(MpiWorld& world, const std::string& refusal);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_MPI_ATTEND_H_
