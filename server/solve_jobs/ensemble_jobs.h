// SPDX-License-Identifier: Apache-2.0
// Ensembles as jobs: each is split into shards, and any server with free cores solves a shard.

#ifndef DLCS_SERVER_SOLVE_JOBS_ENSEMBLE_JOBS_H_
#define DLCS_SERVER_SOLVE_JOBS_ENSEMBLE_JOBS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "dlcs/v1/jobs.pb.h"
#include "server/jobs/job_manager.h"
#include "server/session/request_check.h"
#include "server/solve_jobs/problem_library.h"
#include "server/store/job.h"
#include "server/telemetry/metrics.h"

namespace dlcs {

class SetupCache;
class ShardResults;
class SolveControl;

// The most shards of one ensemble, since each is a row of the store.
inline constexpr std::int64_t kMaxShards = 10'000;

// An ensemble that is ready to be stored. The body is the CreateEnsembleJobRequest without its members, and the input
// of a shard is a SolveEnsembleRequest with only the members of that shard: the two texts concatenated are the request
// for that shard.
struct SplitEnsemble {
  std::string body;
  std::vector<std::string> shards;
  jobs::Demand demand;  // of one shard
  v1::SolveJob about;   // states, constraints, horizon, options and ensemble
};

// Checks the problem, the options and every member, as a solve does, and chooses the size of the shards: 1000 members,
// unless the request asks for another size, the prediction is that they take more than some seconds, or their results
// more than a page. Errors: as PrepareEnsemble(), and ResourceExhausted naming max_result_bytes (of all results
// together) or max_shards. Cost: that of validating every member.
absl::StatusOr<SplitEnsemble> Split(v1::CreateEnsembleJobRequest request, const SessionLimits& limits,
                                    const ProblemResolver& find);

// Safe from several threads.
class EnsembleSolver {
 public:
  // `setups` may be null; all references must outlive it.
  EnsembleSolver(const SessionLimits& limits, SetupCache* setups, const ProblemLibrary& library, Metrics& metrics)
      : limits_(limits), setups_(setups), library_(library), metrics_(metrics) {}

  // One attempt at the shard of `run`. A shard that is stopped starts from its beginning next time.
  jobs::JobEnd Solve(jobs::JobRun& run) const;

 private:
  // Solves the members `broken` of `ensemble` again, now with all nodes as output times, since the last known state of
  // a member that failed is at none of its output times.
  absl::Status FindEnds(const jobs::JobRun& run, const v1::SolveEnsembleRequest& ensemble,
                        const std::vector<Index>& broken, const SolveControl& control, ShardResults& results) const;

  const SessionLimits limits_;
  SetupCache* const setups_;
  const ProblemLibrary& library_;
  Metrics& metrics_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_ENSEMBLE_JOBS_H_
