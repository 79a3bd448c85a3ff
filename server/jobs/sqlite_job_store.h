// SPDX-License-Identifier: Apache-2.0
// The store of jobs, and of the problems they name, in one SQLite file.

#ifndef DLCS_SERVER_JOBS_SQLITE_JOB_STORE_H_
#define DLCS_SERVER_JOBS_SQLITE_JOB_STORE_H_

#include "server/jobs/clock.h"
#include "server/jobs/sqlite_database.h"
#include "server/jobs/sqlite_job_table.h"
#include "server/jobs/store.h"

namespace dlcs::jobs {

// Needs nothing but a folder that can be written. Never fails to be made: a file that cannot be opened is an
// unhealthy store, which looks again at every call (Probe() says what is wrong).
// A commit of a few rows takes as long as the disk takes to synchronise; blobs cost their copy into the log.
class SqliteJobStore final : public Store {
 public:
  // `clock` is the store's time, and must outlive it.
  SqliteJobStore(SqliteDatabaseOptions options, const Clock& clock);

  absl::StatusOr<Created> Create(const NewJob& job) override;
  absl::StatusOr<std::optional<Job>> FindRequest(const std::string& owner, const std::string& request_id,
                                                 const std::string& body_hash) override;
  absl::StatusOr<Job> Get(const std::optional<std::string>& owner, const JobId& id) override;
  absl::StatusOr<JobPage> List(const JobFilter& filter, int page_size, const std::string& page_token) override;
  absl::StatusOr<Job> RequestCancel(const std::optional<std::string>& owner, const JobId& id) override;
  absl::Status Delete(const std::optional<std::string>& owner, const JobId& id) override;

  absl::StatusOr<std::vector<Job>> ListClaimable(int limit) override;
  absl::StatusOr<std::optional<ClaimedJob>> Claim(const std::string& worker, Duration lease,
                                                  std::span<const JobId> candidates) override;
  absl::StatusOr<int> ReleaseLeases(const std::string& worker) override;
  absl::StatusOr<bool> RenewLease(const Lease& lease, Duration duration) override;
  absl::Status Append(const Lease& lease, const Progress& progress) override;
  absl::Status Finish(const Lease& lease, const Outcome& outcome) override;
  absl::Status Release(const Lease& lease, std::int64_t through) override;

  absl::StatusOr<std::vector<Event>> ReadEvents(const JobId& id, std::int64_t after, int limit) override;
  absl::StatusOr<std::vector<Chunk>> ReadChunks(const JobId& id, std::int64_t from, std::int64_t max_bytes) override;
  absl::StatusOr<int> Expire(const Expiry& expiry) override;

  absl::StatusOr<Added> AddProblem(const NewProblem& problem, const ProblemQuota& quota) override;
  absl::StatusOr<StoredProblem> GetProblem(const std::string& owner, const ProblemId& id) override;
  absl::StatusOr<std::string> ReadProblem(const std::string& owner, const ProblemId& id) override;
  absl::Status DeleteProblem(const std::string& owner, const ProblemId& id) override;
  absl::StatusOr<ProblemPage> ListProblems(const std::string& owner, int page_size,
                                           const std::string& page_token) override;

  bool Healthy() const override { return database_.healthy(); }
  absl::Status Probe() override;

 private:
  // Under the name of the function that asks. The result of `rule(JobTable&)` in a transaction of the database.
  template <typename Rule>
  auto Write(Rule rule, const char* operation = __builtin_FUNCTION()) {
    return database_.Write([&](SqliteConnection& connection) {
      SqliteJobTable table(connection, clock_);
      return rule(table);
    }, operation);
  }
  template <typename Rule>
  auto Read(Rule rule, const char* operation = __builtin_FUNCTION()) {
    return database_.Read([&](SqliteConnection& connection) {
      SqliteJobTable table(connection, clock_);
      return rule(table);
    }, operation);
  }

  const Clock& clock_;
  SqliteDatabase database_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_SQLITE_JOB_STORE_H_
