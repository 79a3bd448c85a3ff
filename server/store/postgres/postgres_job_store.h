// SPDX-License-Identifier: Apache-2.0
// The store of jobs in PostgreSQL, for several servers.

#ifndef DLCS_SERVER_STORE_POSTGRES_POSTGRES_JOB_STORE_H_
#define DLCS_SERVER_STORE_POSTGRES_POSTGRES_JOB_STORE_H_

#include <memory>

#include "server/store/postgres/postgres_announcer.h"
#include "server/store/postgres/postgres_database.h"
#include "server/store/postgres/postgres_job_table.h"
#include "server/store/postgres/postgres_listener.h"
#include "server/store/sql_store.h"

namespace dlcs::jobs {

// Construction never fails: with a database that cannot be reached the store is unhealthy, and tries again at every
// call (Probe() says what is wrong). Time is the database server's. A call takes as many round trips as its rule has
// statements, up to about ten, and a commit.
class PostgresJobStore final : public SqlStore<PostgresDatabase, PostgresJobTable> {
 public:
  explicit PostgresJobStore(PostgresDatabaseOptions options);

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

  void Subscribe(std::function<void(const JobChange&)> on_change) override;
  void Publish(const JobChange& change) override;
  absl::Status Probe() override;

 private:
  PostgresJobTable TableIn(PostgresConnection& connection) const override { return PostgresJobTable(connection); }
  void Announce(JobChange::What what, const JobId& id) override { announcer_.Announce(what, id); }

  // Delete finished jobs, and problems that were not used for long. Each returns how many.
  absl::StatusOr<int> ExpireJobs(const Expiry& expiry);
  absl::StatusOr<int> ExpireProblems(const Expiry& expiry);

  PostgresAnnouncer announcer_;
  std::unique_ptr<PostgresListener> listener_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_JOB_STORE_H_
