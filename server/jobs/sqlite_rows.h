// SPDX-License-Identifier: Apache-2.0
// Rows of the job store as structs: what both halves of SqliteJobStore need.

#ifndef DLCS_SERVER_JOBS_SQLITE_ROWS_H_
#define DLCS_SERVER_JOBS_SQLITE_ROWS_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "server/jobs/event.h"
#include "server/jobs/job.h"
#include "server/jobs/sqlite.h"

// The columns that ReadJob() reads, first in a SELECT.
#define DLCS_JOB_COLUMNS                                                                            \
  "number, id, owner, request_id, priority, core_seconds, memory_bytes, threads, deadline, state, " \
  "created, started, finished, attempts, sequence, chunks, progress, error_code, error_message, "   \
  "stored_bytes, fence, worker, lease_until, "                                                      \
  "(SELECT MAX(sequence) FROM events WHERE events.job = jobs.number)"

namespace dlcs::jobs {

struct JobRow {
  std::int64_t number = 0;
  Job job;
  std::int64_t fence = 0;
  std::string worker;
  Time lease_until;
};

JobRow ReadJob(const SqliteStatement& row);

// Nothing when there is none, or it is somebody else's.
std::optional<JobRow> FindJob(SqliteConnection& connection, const std::optional<std::string>& owner, const JobId& id);
absl::Status NoSuchJob(const JobId& id);

// Adds `event` unless it is there; the job's mark rises to its number.
void AddEvent(SqliteConnection& connection, std::int64_t job, const Event& event);
// The job enters `state` and an event with the next number says so. Returns that number.
std::int64_t EnterState(SqliteConnection& connection, std::int64_t job, JobState state, Time now);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_SQLITE_ROWS_H_
