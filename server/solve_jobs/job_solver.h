// SPDX-License-Identifier: Apache-2.0
// Runs the engine in a job, and writes its events and checkpoints to the log and the store.

#ifndef DLCS_SERVER_SOLVE_JOBS_JOB_SOLVER_H_
#define DLCS_SERVER_SOLVE_JOBS_JOB_SOLVER_H_

#include <chrono>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "server/jobs/job_manager.h"
#include "server/jobs/job_run.h"
#include "server/session/request_check.h"
#include "server/session/solve_session.h"
#include "server/solve_jobs/problem_library.h"
#include "server/solve_jobs/rank_launcher.h"
#include "server/solve_jobs/solve_attempt.h"
#include "server/store/job_store.h"

namespace dlcs {

class SetupCache;

// The predicted demand of a job of so many solves one after the other, which share their set-up; accurate to a factor
// of ten in time and three in memory, but for the time where pairs switch hundreds of times. The scheduler corrects the
// time by what jobs actually took.
jobs::Demand PredictDemand(const PreparedSolve& prepared, double solves = 1);

// The body of a job is a serialized v1::SolveRequest; a part of its trajectory is a serialized v1::TrajectoryChunk
// whose indices count the whole trajectory, below 1 MB; the summary is a serialized v1::Summary, and the tally one with
// its termination and verdict alone, for lists.
class JobSolver {
 public:
  // A checkpoint is made if the engine offers one and `checkpoint_every` has passed since the last. `setups` may be
  // null; all references must outlive it. `ranks` says how to start the ranks of a job that requests them; without a
  // launcher, limits.max_ranks is 0.
  JobSolver(const SessionLimits& limits, SetupCache* setups, jobs::JobStore& store, const ProblemLibrary& library,
            std::chrono::milliseconds checkpoint_every, RankSettings ranks)
      : limits_(limits),
        setups_(setups),
        store_(store),
        library_(library),
        checkpoint_every_(checkpoint_every),
        ranks_(std::move(ranks)) {}

  // The predicted demand of the job of `owner` with this body. Errors: as PrepareSolve().
  absl::StatusOr<jobs::Demand> Predict(const std::string& owner, const std::string& body) const;

  // One attempt: resumes after the stored part, and ends with the summary. Safe from several threads.
  jobs::JobEnd Solve(jobs::JobRun& run) const;

 private:
  // Solve() without the tally.
  jobs::JobEnd Attempt(jobs::JobRun& run) const;
  absl::StatusOr<EarlierAttempts> ReadEarlier(const jobs::JobRun& run, const PreparedSolve& prepared) const;

  const SessionLimits limits_;
  SetupCache* const setups_;
  jobs::JobStore& store_;
  const ProblemLibrary& library_;
  const std::chrono::milliseconds checkpoint_every_;
  const RankSettings ranks_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_JOB_SOLVER_H_
