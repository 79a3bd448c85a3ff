// SPDX-License-Identifier: Apache-2.0
// The rows of jobs in PostgreSQL.

#ifndef DLCS_SERVER_STORE_POSTGRES_POSTGRES_JOB_TABLE_H_
#define DLCS_SERVER_STORE_POSTGRES_POSTGRES_JOB_TABLE_H_

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/store/job_table.h"
#include "server/store/postgres/postgres.h"

#define DLCS_POSTGRES_JOB_COLUMNS                                                                            \
  "number, id, owner, request_id, priority, core_seconds, memory_bytes, threads, deadline, state, "          \
  "created, started, finished, attempts, sequence, last_event, chunks, progress, error_code, "               \
  "error_message, stored_bytes, fence, worker, lease_until, body_hash, problem, about, shard_count, tally, " \
  "dlcs_now() "

// True for a job that no worker holds.
#define DLCS_POSTGRES_CLAIMABLE "finished IS NULL AND (state = 1 OR lease_until < dlcs_now())"
// True for a job of which a worker can hold something: the same, or an ensemble with a shard that no worker holds.
#define DLCS_POSTGRES_OPEN                                                               \
  "finished IS NULL AND (state = 1 OR lease_until < dlcs_now() OR (shard_count > 0 AND " \
  "EXISTS (SELECT 1 FROM shards WHERE shards.job = jobs.number AND shards.lease_until < dlcs_now())))"

namespace dlcs::jobs {

// The rows of an answer whose columns are DLCS_POSTGRES_JOB_COLUMNS.
std::vector<JobRow> ReadJobs(const PostgresRows& rows);

// The rows in the transaction of `connection`.
class PostgresJobTable final : public JobTable {
 public:
  explicit PostgresJobTable(PostgresConnection& connection) : connection_(connection) {}

  std::optional<JobRow> Find(const JobId& id) override;
  std::optional<JobRow> Lock(const JobId& id) override;
  std::optional<JobRow> LockClaimable(std::span<const JobId> candidates) override;
  std::vector<JobId> EnsemblesAmong(std::span<const JobId> candidates) override;
  std::optional<JobRow> FindRequest(const std::string& owner, const std::string& request_id) override;
  bool UseProblem(const std::string& owner, const std::string& id) override;
  std::optional<JobRow> Insert(const NewJob& job) override;
  void Save(const JobRow& row) override;
  void Delete(std::int64_t number) override;
  std::string ReadBody(std::int64_t number) override;
  std::optional<std::string> ReadResumeState(std::int64_t number) override;
  void SaveResumeState(std::int64_t number, const std::string& state) override;
  void DropResumeState(std::int64_t number) override;
  bool AddEvent(std::int64_t number, const Event& event) override;
  bool AddChunk(std::int64_t number, const Chunk& chunk) override;
  std::optional<ShardRow> FindShard(std::int64_t number, std::int64_t shard) override;
  std::optional<ShardRow> FindClaimableShard(std::int64_t number) override;
  std::string ReadShardInput(std::int64_t number, std::int64_t shard) override;
  void SaveShard(std::int64_t number, const ShardRow& shard) override;
  void DropShards(std::int64_t number, std::optional<std::int64_t> shard) override;

 private:
  PostgresConnection& connection_;
};

// Marks the problem as used now, and locks it until the transaction ends. False if the owner has none with this id.
bool MarkUsed(PostgresConnection& connection, const std::string& owner, const std::string& id);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_JOB_TABLE_H_
