// SPDX-License-Identifier: Apache-2.0
// Ensembles whose members are shared among the ranks of MPI.

#ifndef DLCS_CLIENT_MPI_RANK_ENSEMBLE_H_
#define DLCS_CLIENT_MPI_RANK_ENSEMBLE_H_

#include "absl/status/status.h"
#include "core/mpi/mpi_team.h"
#include "dlcs/v1/solver.pb.h"
#include "server/session/ensemble_session.h"

namespace dlcs::client {

// As RunEnsembleToEnd(), on all ranks of `team`: each solves every size-th member, by itself. The first rank receives
// the events of all members, in the order of members; the others receive the summary alone, which is the same on all.
// Members are solved in rounds, after each of which the first rank gets their results; a stop that any rank requests
// ends all after the round. Cost: the results of a round are held, up to 64 MB or one member for each rank.
// Errors: also FailedPrecondition if the ranks have read different ensembles.
absl::Status RunEnsembleOnRanks(const v1::SolveEnsembleRequest& request, const SessionLimits& limits,
                                const SolveControl& control, const EnsembleEvents& take, MpiTeam& team);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_MPI_RANK_ENSEMBLE_H_
