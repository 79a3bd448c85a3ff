// SPDX-License-Identifier: Apache-2.0
// An attempt at a job on ranks of MPI, which a launcher starts.

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

// Starts `request.options().ranks()` ranks for `run`, and is the worker of the first of them: serves RankLink
// (server/solve_jobs/rank_link.proto) on a free port of `settings.host` for these ranks alone, which know the secret of
// this attempt. Events, windows and the end are passed on to the run; requests to stop to the ranks, who have some
// seconds to end before they are ended. Returns when launcher and ranks have ended.
//
// Ends as jobs::SolveFunction says: as the first rank tells; with FAILED_PRECONDITION where the launcher cannot be
// started, ends before its first rank is there, or starts another world than it was asked for; ABORTED where ranks are
// killed, end without a word, or give no sign of life for `settings.patience`. `request` names no uploaded problem.
// `limits` are those of one rank.
jobs::JobEnd SolveOnRanks(const RankSettings& settings, v1::SolveRequest request, EarlierAttempts earlier,
                          std::chrono::milliseconds checkpoint_every, const SessionLimits& limits, jobs::JobRun& run);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_RANK_ATTEMPT_H_
