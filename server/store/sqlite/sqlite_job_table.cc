// SPDX-License-Identifier: Apache-2.0
#include "server/store/sqlite/sqlite_job_table.h"

#include <utility>

namespace dlcs::jobs {

static_assert(static_cast<int>(JobState::kQueued) == 1, "DLCS_CLAIMABLE says so");

namespace {

std::optional<ShardRow> FirstShard(SqliteStatement& query) {
  if (!query.Step()) return std::nullopt;
  return ShardRow{.number = query.Int(0),
                  .worker = query.Bytes(1),
                  .lease_until = query.TimeAt(2),
                  .fence = query.Int(3),
                  .attempts = static_cast<int>(query.Int(4))};
}

}  // namespace

JobRow ReadJob(const SqliteStatement& row) {
  int column = 0;
  JobRow result;
  Job& job = result.job;
  result.number = row.Int(column++);
  job.id = row.Bytes(column++);
  job.owner = row.Bytes(column++);
  job.request_id = row.Bytes(column++);
  job.priority = static_cast<int>(row.Int(column++));
  job.demand.core_seconds = row.Real(column++);
  job.demand.memory_bytes = row.Int(column++);
  job.demand.threads = static_cast<int>(row.Int(column++));
  job.deadline = row.OptionalTime(column++);
  job.state = static_cast<JobState>(row.Int(column++));
  job.created = row.TimeAt(column++);
  job.started = row.OptionalTime(column++);
  job.finished = row.OptionalTime(column++);
  job.attempts = static_cast<int>(row.Int(column++));
  job.sequence = row.Int(column++);
  job.chunks = row.Int(column++);
  job.progress = row.Real(column++);
  const auto code = static_cast<absl::StatusCode>(row.Int(column++));
  job.error = absl::Status(code, row.Bytes(column++));
  job.stored_bytes = row.Int(column++);
  result.fence = row.Int(column++);
  result.worker = row.Bytes(column++);
  result.lease_until = row.TimeAt(column++);
  result.body_hash = row.Bytes(column++);
  job.problem = row.Bytes(column++);
  job.about = row.Bytes(column++);
  job.shards = row.Int(column++);
  job.tally = row.Bytes(column++);
  job.last_event = row.Int(column++);
  return result;
}

std::optional<JobRow> SqliteJobTable::ReadFirst(SqliteStatement& query) const {
  if (!query.Step()) return std::nullopt;
  JobRow row = ReadJob(query);
  row.now = clock_.Now();
  return row;
}

std::optional<JobRow> SqliteJobTable::Find(const JobId& id) {
  const auto query = connection_.Prepare("SELECT " DLCS_JOB_COLUMNS " FROM jobs WHERE id = ?1");
  query->Bind(id);
  return ReadFirst(*query);
}

std::optional<JobRow> SqliteJobTable::LockClaimable(std::span<const JobId> candidates) {
  for (const JobId& id : candidates) {
    const auto query = connection_.Prepare("SELECT " DLCS_JOB_COLUMNS " FROM jobs WHERE id = ?2 AND " DLCS_CLAIMABLE);
    query->Bind(clock_.Now(), id);
    if (std::optional<JobRow> row = ReadFirst(*query)) return row;
  }
  return std::nullopt;
}

std::vector<JobId> SqliteJobTable::EnsemblesAmong(std::span<const JobId> candidates) {
  std::vector<JobId> ids;
  for (const JobId& id : candidates) {
    if (const std::optional<JobRow> row = Find(id); row.has_value() && row->job.shards > 0) ids.push_back(id);
  }
  return ids;
}

std::optional<JobRow> SqliteJobTable::FindRequest(const std::string& owner, const std::string& request_id) {
  const auto query = connection_.Prepare("SELECT " DLCS_JOB_COLUMNS
                                         " FROM jobs WHERE owner = ?1 AND request_id = ?2 AND request_id <> ''");
  query->Bind(owner, request_id);
  return ReadFirst(*query);
}

bool SqliteJobTable::UseProblem(const std::string& owner, const std::string& id) {
  return MarkUsed(connection_, owner, id, clock_.Now());
}

std::optional<JobRow> SqliteJobTable::Insert(const NewJob& job) {
  connection_.Run(
      "INSERT INTO jobs (id, owner, request_id, body_hash, priority, core_seconds, memory_bytes, threads, deadline,"
      " state, created, sequence, stored_bytes, problem, about, shard_count)"
      " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, 0, ?12, ?13, ?14, ?15)",
      job.id, job.owner, job.request_id, Blob{job.body_hash}, job.priority, job.demand.core_seconds,
      job.demand.memory_bytes, job.demand.threads, job.deadline, static_cast<int>(JobState::kQueued), clock_.Now(),
      static_cast<std::int64_t>(job.body.size()), job.problem, Blob{job.about},
      static_cast<std::int64_t>(job.shards.size()));
  const std::int64_t number = connection_.LastRowId();
  connection_.Run("INSERT INTO bodies (job, body) VALUES (?1, ?2)", number, Blob{job.body});
  for (std::size_t k = 0; k < job.shards.size(); ++k) {
    connection_.Run("INSERT INTO shards (job, number, input) VALUES (?1, ?2, ?3)", number, static_cast<std::int64_t>(k),
                    Blob{job.shards[k]});
  }
  return Lock(job.id);
}

void SqliteJobTable::Save(const JobRow& row) {
  const Job& job = row.job;
  connection_.Run(
      "UPDATE jobs SET state = ?2, started = ?3, finished = ?4, worker = ?5, lease_until = ?6, fence = ?7,"
      " attempts = ?8, sequence = ?9, chunks = ?10, progress = ?11, error_code = ?12, error_message = ?13,"
      " stored_bytes = ?14, tally = ?15 WHERE number = ?1",
      row.number, static_cast<int>(job.state), job.started, job.finished, row.worker, row.lease_until, row.fence,
      job.attempts, job.sequence, job.chunks, job.progress, static_cast<int>(job.error.code()),
      std::string(job.error.message()), job.stored_bytes, Blob{job.tally});
}

void SqliteJobTable::Delete(std::int64_t number) { connection_.Run("DELETE FROM jobs WHERE number = ?1", number); }

std::optional<std::string> SqliteJobTable::ReadBlob(const char* sql, std::int64_t number) {
  const auto query = connection_.Prepare(sql);
  query->Bind(number);
  if (!query->Step()) return std::nullopt;
  return query->Bytes(0);
}

std::string SqliteJobTable::ReadBody(std::int64_t number) {
  return ReadBlob("SELECT body FROM bodies WHERE job = ?1", number).value_or("");
}

std::optional<std::string> SqliteJobTable::ReadResumeState(std::int64_t number) {
  return ReadBlob("SELECT state FROM resume_states WHERE job = ?1", number);
}

void SqliteJobTable::SaveResumeState(std::int64_t number, const std::string& state) {
  connection_.Run("INSERT OR REPLACE INTO resume_states (job, state) VALUES (?1, ?2)", number, Blob{state});
}

void SqliteJobTable::DropResumeState(std::int64_t number) {
  connection_.Run("DELETE FROM resume_states WHERE job = ?1", number);
}

bool SqliteJobTable::AddEvent(std::int64_t number, const Event& event) {
  return connection_.Run(
             "INSERT OR IGNORE INTO events (job, sequence, time, kind, payload) VALUES (?1, ?2, ?3, ?4, ?5)", number,
             event.sequence, event.time, static_cast<int>(event.kind), Blob{*event.payload}) > 0;
}

bool SqliteJobTable::AddChunk(std::int64_t number, const Chunk& chunk) {
  return connection_.Run(
             "INSERT OR IGNORE INTO chunks (job, number, begin_time, end_time, data) VALUES (?1, ?2, ?3, ?4, ?5)",
             number, chunk.number, chunk.begin, chunk.end, Blob{chunk.data}) > 0;
}

std::optional<ShardRow> SqliteJobTable::FindShard(std::int64_t number, std::int64_t shard) {
  const auto query = connection_.Prepare(
      "SELECT number, worker, lease_until, fence, attempts FROM shards WHERE job = ?1 AND number = ?2");
  query->Bind(number, shard);
  return FirstShard(*query);
}

std::optional<ShardRow> SqliteJobTable::FindClaimableShard(std::int64_t number) {
  const auto query = connection_.Prepare(
      "SELECT number, worker, lease_until, fence, attempts FROM shards WHERE job = ?1 AND lease_until < ?2"
      " ORDER BY number LIMIT 1");
  query->Bind(number, clock_.Now());
  return FirstShard(*query);
}

std::string SqliteJobTable::ReadShardInput(std::int64_t number, std::int64_t shard) {
  const auto query = connection_.Prepare("SELECT input FROM shards WHERE job = ?1 AND number = ?2");
  query->Bind(number, shard);
  return query->Step() ? query->Bytes(0) : "";
}

void SqliteJobTable::SaveShard(std::int64_t number, const ShardRow& shard) {
  connection_.Run(
      "UPDATE shards SET worker = ?3, lease_until = ?4, fence = ?5, attempts = ?6 WHERE job = ?1 AND number = ?2",
      number, shard.number, shard.worker, shard.lease_until, shard.fence, shard.attempts);
}

void SqliteJobTable::DropShards(std::int64_t number, std::optional<std::int64_t> shard) {
  connection_.Run("DELETE FROM shards WHERE job = ?1 AND (?2 < 0 OR number = ?2)", number, shard.value_or(-1));
}

}  // namespace dlcs::jobs
