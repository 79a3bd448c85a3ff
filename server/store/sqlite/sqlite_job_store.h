// SPDX-License-Identifier: Apache-2.0
// The store of jobs, and of the problems they name, in one SQLite file.

#ifndef DLCS_SERVER_STORE_SQLITE_SQLITE_JOB_STORE_H_
#define DLCS_SERVER_STORE_SQLITE_SQLITE_JOB_STORE_H_

#include "server/store/clock.h"
#include "server/store/sql_store.h"
#include "server/store/sqlite/sqlite_database.h"
#include "server/store/sqlite/sqlite_job_table.h"

namespace dlcs::jobs {

// Needs only a writable folder. Construction never fails: with a file that cannot be opened the store is unhealthy, and
// tries again at every call (Probe() says what is wrong).
// A commit of a few rows takes as long as one flush of the disk; blobs cost a copy into the log.
class SqliteJobStore final : public SqlStore<SqliteDatabase, SqliteJobTable> {
 public:
  // `clock` is the store's time, and must outlive it.
  SqliteJobStore(SqliteDatabaseOptions options, const Clock& clock);

  absl::StatusOr<JobPage> List(const JobFilter& filter, int page_size, const std::string& page_token) override;
  absl::StatusOr<std::vector<Job>> ListClaimable(int limit) override;
  absl::StatusOr<QueueDepth> MeasureQueue() override;
  absl::StatusOr<int> ReleaseLeases(const std::string& worker) override;
  absl::StatusOr<std::vector<Event>> ReadEvents(const JobId& id, std::int64_t after, int limit) override;
  absl::StatusOr<std::vector<Chunk>> ReadChunks(const JobId& id, std::int64_t from, std::int64_t max_bytes) override;
  absl::StatusOr<int> Expire(const Expiry& expiry) override;

  absl::StatusOr<Added> AddProblem(const NewProblem& problem, const ProblemQuota& quota) override;
  absl::StatusOr<StoredProblem> GetProblem(const std::string& owner, const ProblemId& id) override;
  absl::StatusOr<std::string> ReadProblem(const std::string& owner, const ProblemId& id) override;
  absl::Status DeleteProblem(const std::string& owner, const ProblemId& id) override;
  absl::StatusOr<ProblemPage> ListProblems(const std::string& owner, int page_size,
                                           const std::string& page_token) override;

  absl::Status Probe() override;

 private:
  SqliteJobTable TableIn(SqliteConnection& connection) const override { return SqliteJobTable(connection, clock_); }

  const Clock& clock_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_SQLITE_SQLITE_JOB_STORE_H_
