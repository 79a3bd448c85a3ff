// SPDX-License-Identifier: Apache-2.0
// One attempt at a job on ranks of MPI, which a launcher starts.

#ifndef DLCS_SERVER_SOLVE_JOBS_RANK_ATTEMPT_H_
#define DLCS_SERVER_SOLVE_JOBS_RANK_ATTEMPT_H_

#include <chrono>

#include "dlcs/v1/solver.pb.h"
#include "server/jobs/job_manager.h"
#include "server/jobs/job_run.h"
#include "server/session/request_check.h"
#include "server/solve_jobs/rank_launcher.h"
#include "server/solve_jobs/solve_attempt.h"

namespace dlcs {

// Starts `request.options().ranks()` ranks for `run`, and serves RankLink (server/solve_jobs/rank_link.proto) to them
// on a free port of `settings.host`. Only these ranks know the secret of the attempt. Events, windows and the end are
// passed to the run, and requests to stop to the ranks, which are ended if they still run some seconds later. Returns
// when the launcher and the ranks have ended.
//
// The result is that of jobs::SolveFunction, as sent by the first rank. Further errors: FAILED_PRECONDITION if the
// launcher cannot be started, ends before its first rank has connected, or starts another number of ranks; ABORTED if
// ranks were killed, end without a result, or do not respond for `settings.patience`. `request` holds the problem
// itself, not its name. `limits` are those of one rank.
jobs::JobEnd SolveOnRanks(const RankSettings& settings, v1::SolveRequest request, EarlierAttempts earlier,
                          std::chrono::milliseconds checkpoint_every, const SessionLimits& limits, jobs::JobRun& run);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_RANK_ATTEMPT_H_
