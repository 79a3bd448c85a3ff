// SPDX-License-Identifier: Apache-2.0
// The rows of jobs in SQLite.

#ifndef DLCS_SERVER_STORE_SQLITE_SQLITE_JOB_TABLE_H_
#define DLCS_SERVER_STORE_SQLITE_SQLITE_JOB_TABLE_H_

#include <optional>
#include <span>
#include <string>

#include "server/store/clock.h"
#include "server/store/job_table.h"
#include "server/store/sqlite/sqlite.h"

// The columns that ReadJob() reads, first in a SELECT.
#define DLCS_JOB_COLUMNS                                                                            \
  "number, id, owner, request_id, priority, core_seconds, memory_bytes, threads, deadline, state, " \
  "created, started, finished, attempts, sequence, chunks, progress, error_code, error_message, "   \
  "stored_bytes, fence, worker, lease_until, body_hash, problem, about, shard_count, tally, "       \
  "(SELECT MAX(sequence) FROM events WHERE events.job = jobs.number)"

// True for a job that no worker holds at the time ?1.
#define DLCS_CLAIMABLE "finished IS NULL AND (state = 1 OR lease_until < ?1)"
// True for a job of which a worker can hold something: the same, or an ensemble with a shard that no worker holds.
#define DLCS_OPEN                                                                \
  "finished IS NULL AND (state = 1 OR lease_until < ?1 OR (shard_count > 0 AND " \
  "EXISTS (SELECT 1 FROM shards WHERE shards.job = jobs.number AND shards.lease_until < ?1)))"

namespace dlcs::jobs {

// Without JobRow::now.
JobRow ReadJob(const SqliteStatement& row);

// The rows in the transaction of `connection`. A transaction that writes has locked all rows.
class SqliteJobTable final : public JobTable {
 public:
  SqliteJobTable(SqliteConnection& connection, const Clock& clock) : connection_(connection), clock_(clock) {}

  std::optional<JobRow> Find(const JobId& id) override;
  std::optional<JobRow> Lock(const JobId& id) override { return Find(id); }
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
  std::optional<JobRow> ReadFirst(SqliteStatement& query) const;
  std::optional<std::string> ReadBlob(const char* sql, std::int64_t number);

  SqliteConnection& connection_;
  const Clock& clock_;
};

// The problem was used at `now`. False when the owner has none of this id.
bool MarkUsed(SqliteConnection& connection, const std::string& owner, const std::string& id, Time now);
// Deletes at most `limit` problems that were last used before `since` and that no job holds. Returns how many.
std::int64_t DeleteUnusedProblems(SqliteConnection& connection, Time since, std::int64_t limit);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_SQLITE_SQLITE_JOB_TABLE_H_
