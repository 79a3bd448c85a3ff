// SPDX-License-Identifier: Apache-2.0
// The functions of JobStore as operations on the rows of a job, shared by all databases. Each runs in its own
// transaction, and has the errors of the corresponding function in job_store.h.

#ifndef DLCS_SERVER_STORE_JOB_TRANSITIONS_H_
#define DLCS_SERVER_STORE_JOB_TRANSITIONS_H_

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/job_store.h"
#include "server/store/job_table.h"

namespace dlcs::jobs {

// Called for users.
absl::StatusOr<JobStore::Created> CreateJob(JobTable& table, const NewJob& job);
absl::StatusOr<std::optional<Job>> FindRequestedJob(JobTable& table, const std::string& owner,
                                                    const std::string& request_id, const std::string& body_hash);
absl::StatusOr<Job> RequestCancelOfJob(JobTable& table, const std::optional<std::string>& owner, const JobId& id);
absl::Status DeleteJob(JobTable& table, const std::optional<std::string>& owner, const JobId& id);

// Called by workers.
absl::StatusOr<std::optional<ClaimedJob>> ClaimJob(JobTable& table, const std::string& worker, Duration lease,
                                                   std::span<const JobId> candidates);
absl::StatusOr<bool> RenewLeaseOfJob(JobTable& table, const Lease& lease, Duration duration);
absl::Status AppendToJob(JobTable& table, const Lease& lease, const Progress& progress);
absl::Status FinishJob(JobTable& table, const Lease& lease, const Outcome& outcome);
absl::Status FinishShardOfJob(JobTable& table, const Lease& lease, const ShardResult& result);
absl::Status ReleaseJob(JobTable& table, const Lease& lease, std::int64_t through, bool in_vain);

// The job of `row`, if it exists and `owner` may see it.
absl::StatusOr<Job> VisibleJob(const std::optional<JobRow>& row, const std::optional<std::string>& owner,
                               const JobId& id);
// The row number below which a page begins. Errors: INVALID_ARGUMENT for an invalid token or page size.
absl::StatusOr<std::int64_t> BeginOfPage(const std::string& page_token, int page_size);
// One bit per state, at its number; all bits for an empty list.
std::int64_t MaskOf(const std::vector<JobState>& states);

// The most jobs, and the most problems, that one call of Expire() deletes.
inline constexpr std::int64_t kMaxDeletedAtOnce = 200;

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_JOB_TRANSITIONS_H_
