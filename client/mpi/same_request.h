// SPDX-License-Identifier: Apache-2.0
// Whether all ranks were asked for the same solve: their files and command lines may differ.

#ifndef DLCS_CLIENT_MPI_SAME_REQUEST_H_
#define DLCS_CLIENT_MPI_SAME_REQUEST_H_

#include <string>

#include "absl/status/status.h"
#include "client/cli/commands/commands.h"
#include "core/mpi/mpi_team.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// All ranks of `team` call these together, and get the same answer. They compare hashes of each part by Team::IsSame().

// Whether the files at `path` have the same text, so that all ranks read the same files that they name.
bool HaveSameText(const std::string& path, MpiTeam& team);

// Errors: InvalidArgument if ranks have other options (but for threads), or another format or place for the result.
absl::Status CheckSameOptions(const SolveCommand& command, MpiTeam& team);

// Errors: FailedPrecondition with the part of the problem, or the options, that differs. Matrices that are read by rows
// have no entries here. Cost: a pass over the request, and no copy.
absl::Status CheckSameRequest(const v1::SolveRequest& request, MpiTeam& team);

// The same for an ensemble.
absl::Status CheckSameEnsemble(const v1::SolveEnsembleRequest& request, MpiTeam& team);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_MPI_SAME_REQUEST_H_
