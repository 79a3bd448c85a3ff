// SPDX-License-Identifier: Apache-2.0
// The stored results of an ensemble that runs as a job: collecting and reading them.

#ifndef DLCS_SERVER_SOLVE_JOBS_ENSEMBLE_RESULTS_H_
#define DLCS_SERVER_SOLVE_JOBS_ENSEMBLE_RESULTS_H_

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/problem.h"
#include "dlcs/v1/jobs.pb.h"
#include "server/session/solve_session.h"
#include "server/store/job_store.h"
#include "server/wire/component_names.h"

namespace dlcs {

// The values to keep of each member of an ensemble of `base`. Errors: InvalidArgument naming results.x_components[k]
// and the like for a component that does not exist, is there twice or is omitted.
absl::StatusOr<std::vector<v1::EnsembleColumn>> ColumnsOf(const v1::KeptResults& kept, const Problem& base,
                                                          const ComponentNames& names);

// Bytes of the results of one member, in messages and in the store.
std::int64_t MemberResultBytes(std::size_t columns);

// Collects the results of one shard. Not thread-safe.
class ShardResults {
 public:
  // For a shard of `members` members, the first of which has the number `first` in its ensemble.
  ShardResults(std::vector<v1::EnsembleColumn> columns, std::int64_t first, Index members);

  // `member` counts from the first of the shard. Cost: one pass over the trajectory if extrema are kept.
  void Add(Index member, FinishedSolve solve);

  // Replaces the values at the end of `member`, which was added before, by those at the end of `solve`, and updates its
  // extrema.
  void SetEnd(Index member, FinishedSolve solve);

  // Call it once, after all members were added.
  jobs::ShardResult Take() &&;

 private:
  double* ValuesOf(Index member) {
    return shard_.mutable_values()->mutable_data() + member * static_cast<Index>(columns_.size());
  }

  std::vector<v1::EnsembleColumn> columns_;
  bool keeps_extrema_;
  v1::EnsembleShard shard_;
  v1::EnsembleCounts counts_;
  std::map<Index, v1::MemberFailure> failures_;  // of the first members that have one
};

// Answers a ReadEnsembleRequest page by page; each costs a read of the store and the memory of some pages.
class EnsembleReader {
 public:
  // `owner` as in JobStore. Errors: InvalidArgument for a token that is not from a page of this job.
  static absl::StatusOr<EnsembleReader> Create(jobs::JobStore& store, std::optional<std::string> owner,
                                               const jobs::JobId& id, const v1::ReadEnsembleRequest& request);

  // The next page; absent if no further shard is stored and the job has not ended. Blocks on the store. Errors:
  // NotFound, also for a job of another user; FailedPrecondition for a solve; those of the store.
  absl::StatusOr<std::optional<v1::EnsemblePage>> Next();

  // A page without a shard, for readers that wait.
  v1::EnsemblePage EmptyPage() const;

 private:
  EnsembleReader(jobs::JobStore& store, std::optional<std::string> owner, jobs::JobId id)
      : store_(&store), owner_(std::move(owner)), id_(std::move(id)) {}

  jobs::JobStore* store_;
  std::optional<std::string> owner_;
  jobs::JobId id_;
  std::int64_t next_ = 0;         // in the order in which shards were stored
  std::deque<jobs::Chunk> read_;  // from next_ on
};

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_ENSEMBLE_RESULTS_H_
