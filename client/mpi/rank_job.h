// SPDX-License-Identifier: Apache-2.0
// Solves a job of dlcsd on the ranks that its launcher has started.

#ifndef DLCS_CLIENT_MPI_RANK_JOB_H_
#define DLCS_CLIENT_MPI_RANK_JOB_H_

#include <string>

#include "core/mpi/mpi_world.h"

namespace dlcs::client {

// Called by all ranks. The first one connects to the worker, a dlcsd, whose address is in the environment
// (server/solve_jobs/rank_launcher.h). It receives the work, broadcasts it to the others, and sends events, checkpoints
// and the end to the worker. If the world has the wrong size, `refusal` says so, and the worker receives it.
//
// If the worker requests a stop, all ranks agree on the step at which they stop. If the connection to the worker is
// lost, they stop too; the process is ended after some seconds if that takes longer. Returns the exit code: not 0 if
// there is no worker or the solve failed.
int RunRankJob(MpiWorld& world, const std::string& refusal);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_MPI_RANK_JOB_H_
