// SPDX-License-Identifier: Apache-2.0
// The trajectory of a job, from the parts in the store.

#ifndef DLCS_SERVER_SOLVE_JOBS_JOB_TRAJECTORY_H_
#define DLCS_SERVER_SOLVE_JOBS_JOB_TRAJECTORY_H_

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "core/types.h"
#include "dlcs/v1/jobs.pb.h"
#include "server/store/job_store.h"

namespace dlcs {

// The largest number of times for which a chunk stays below 1 MB; at least one.
Index MostTimesInChunk(Index states, Index constraints, Index outputs);

struct StoredTrajectory {
  Matrix x;  // m × times
  Matrix y;  // n × times
  Matrix w;  // n × times
};

// The first `parts` parts. Errors: DataLoss if they do not fit together; those of the store.
absl::StatusOr<StoredTrajectory> ReadStoredTrajectory(jobs::JobStore& store, const jobs::JobId& id, std::int64_t parts,
                                                      Index states, Index constraints);

// Answers a ReadTrajectoryRequest page by page; each costs a read of the store and the memory of two pages.
class TrajectoryReader {
 public:
  // `owner` as in JobStore. Errors: InvalidArgument for a stride below 0, or a token that is not from a page.
  static absl::StatusOr<TrajectoryReader> Create(jobs::JobStore& store, std::optional<std::string> owner,
                                                 const jobs::JobId& id, const v1::ReadTrajectoryRequest& request);

  // Nothing after the last page. Blocks on the store. Errors: NotFound, also for a job of another user; InvalidArgument
  // for a component that does not exist; those of the store.
  absl::StatusOr<std::optional<v1::TrajectoryPage>> Next();

 private:
  TrajectoryReader(jobs::JobStore& store, std::optional<std::string> owner, jobs::JobId id,
                   const v1::ReadTrajectoryRequest& request)
      : store_(&store), owner_(std::move(owner)), id_(std::move(id)), request_(request) {}

  // The requested part of `chunk`. Errors: InvalidArgument for a component that does not exist.
  absl::StatusOr<v1::TrajectoryChunk> Select(const v1::TrajectoryChunk& chunk) const;

  jobs::JobStore* store_;
  std::optional<std::string> owner_;
  jobs::JobId id_;
  v1::ReadTrajectoryRequest request_;
  std::int64_t next_part_ = 0;
  std::deque<jobs::Chunk> read_;  // parts from next_part_ on
  bool ended_ = false;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_JOB_TRAJECTORY_H_
