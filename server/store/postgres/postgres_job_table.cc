// SPDX-License-Identifier: Apache-2.0
#include "server/store/postgres/postgres_job_table.h"

#include <utility>

namespace dlcs::jobs {
namespace {

static_assert(static_cast<int>(JobState::kQueued) == 1, "DLCS_POSTGRES_CLAIMABLE says so");

std::optional<JobRow> First(const PostgresRows& rows) {
  std::vector<JobRow> jobs = ReadJobs(rows);
  if (jobs.empty()) return std::nullopt;
  return std::move(jobs.front());
}

std::optional<ShardRow> FirstShard(const PostgresRows& rows) {
  if (rows.empty()) return std::nullopt;
  return ShardRow{.number = rows.Int(0, 0),
                  .worker = rows.Bytes(0, 1),
                  .lease_until = rows.TimeAt(0, 2),
                  .fence = rows.Int(0, 3),
                  .attempts = static_cast<int>(rows.Int(0, 4))};
}

std::optional<std::string> FirstBytes(const PostgresRows& rows) {
  if (rows.empty()) return std::nullopt;
  return rows.Bytes(0, 0);
}

// An array in PostgreSQL's syntax. Only valid ids are included, which need no quotes.
std::string ArrayOf(std::span<const JobId> ids) {
  std::string array = "{";
  for (const JobId& id : ids) {
    if (!IsJobId(id)) continue;
    if (array.size() > 1) array += ',';
    array += id;
  }
  return array + "}";
}

}  // namespace

std::vector<JobRow> ReadJobs(const PostgresRows& rows) {
  std::vector<JobRow> jobs;
  for (int row = 0; row < rows.size(); ++row) {
    int column = 0;
    JobRow& result = jobs.emplace_back();
    Job& job = result.job;
    result.number = rows.Int(row, column++);
    job.id = rows.Bytes(row, column++);
    job.owner = rows.Bytes(row, column++);
    job.request_id = rows.Bytes(row, column++);
    job.priority = static_cast<int>(rows.Int(row, column++));
    job.demand.core_seconds = rows.Real(row, column++);
    job.demand.memory_bytes = rows.Int(row, column++);
    job.demand.threads = static_cast<int>(rows.Int(row, column++));
    job.deadline = rows.OptionalTime(row, column++);
    job.state = static_cast<JobState>(rows.Int(row, column++));
    job.created = rows.TimeAt(row, column++);
    job.started = rows.OptionalTime(row, column++);
    job.finished = rows.OptionalTime(row, column++);
    job.attempts = static_cast<int>(rows.Int(row, column++));
    job.sequence = rows.Int(row, column++);
    job.last_event = rows.Int(row, column++);
    job.chunks = rows.Int(row, column++);
    job.progress = rows.Real(row, column++);
    const auto code = static_cast<absl::StatusCode>(rows.Int(row, column++));
    job.error = absl::Status(code, rows.Bytes(row, column++));
    job.stored_bytes = rows.Int(row, column++);
    result.fence = rows.Int(row, column++);
    result.worker = rows.Bytes(row, column++);
    result.lease_until = rows.TimeAt(row, column++);
    result.body_hash = rows.Bytes(row, column++);
    job.problem = rows.Bytes(row, column++);
    job.about = rows.Bytes(row, column++);
    job.shards = rows.Int(row, column++);
    job.tally = rows.Bytes(row, column++);
    result.now = rows.TimeAt(row, column++);
  }
  return jobs;
}

std::optional<JobRow> PostgresJobTable::Find(const JobId& id) {
  if (!IsJobId(id)) return std::nullopt;  // callers may send any bytes, which TEXT cannot hold
  return First(connection_.Run("SELECT " DLCS_POSTGRES_JOB_COLUMNS "FROM jobs WHERE id = $1", id));
}

std::optional<JobRow> PostgresJobTable::Lock(const JobId& id) {
  if (!IsJobId(id)) return std::nullopt;
  return First(connection_.Run("SELECT " DLCS_POSTGRES_JOB_COLUMNS "FROM jobs WHERE id = $1 FOR UPDATE", id));
}

std::optional<JobRow> PostgresJobTable::LockClaimable(std::span<const JobId> candidates) {
  return First(connection_.Run("SELECT " DLCS_POSTGRES_JOB_COLUMNS
                               "FROM jobs WHERE id = ANY($1::text[]) AND " DLCS_POSTGRES_CLAIMABLE
                               " ORDER BY array_position($1::text[], id) LIMIT 1 FOR UPDATE SKIP LOCKED",
                               ArrayOf(candidates)));
}

std::vector<JobId> PostgresJobTable::EnsemblesAmong(std::span<const JobId> candidates) {
  const PostgresRows rows = connection_.Run(
      "SELECT id FROM jobs WHERE id = ANY($1::text[]) AND shard_count > 0 ORDER BY array_position($1::text[], id)",
      ArrayOf(candidates));
  std::vector<JobId> ids;
  for (int row = 0; row < rows.size(); ++row) ids.push_back(rows.Bytes(row, 0));
  return ids;
}

std::optional<JobRow> PostgresJobTable::FindRequest(const std::string& owner, const std::string& request_id) {
  return First(connection_.Run("SELECT " DLCS_POSTGRES_JOB_COLUMNS
                               "FROM jobs WHERE owner = $1 AND request_id = $2 AND request_id <> ''",
                               owner, Bytea{request_id}));
}

bool PostgresJobTable::UseProblem(const std::string& owner, const std::string& id) {
  return MarkUsed(connection_, owner, id);
}

std::optional<JobRow> PostgresJobTable::Insert(const NewJob& job) {
  std::optional<JobRow> row = First(connection_.Run(
      "INSERT INTO jobs (id, owner, request_id, body_hash, priority, core_seconds, memory_bytes, threads, deadline,"
      " state, created, stored_bytes, problem, about, shard_count)"
      " VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, dlcs_now(), $11, $12, $13, $14)"
      " ON CONFLICT DO NOTHING RETURNING " DLCS_POSTGRES_JOB_COLUMNS,
      job.id, job.owner, Bytea{job.request_id}, Bytea{job.body_hash}, job.priority, job.demand.core_seconds,
      job.demand.memory_bytes, job.demand.threads, job.deadline, static_cast<int>(JobState::kQueued),
      static_cast<std::int64_t>(job.body.size()), job.problem, Bytea{job.about},
      static_cast<std::int64_t>(job.shards.size())));
  if (!row.has_value()) return row;
  connection_.Run("INSERT INTO bodies (job, body) VALUES ($1, $2)", row->number, Bytea{job.body});
  for (std::size_t k = 0; k < job.shards.size(); ++k) {
    connection_.Run("INSERT INTO shards (job, number, input) VALUES ($1, $2, $3)", row->number,
                    static_cast<std::int64_t>(k), Bytea{job.shards[k]});
  }
  return row;
}

void PostgresJobTable::Save(const JobRow& row) {
  const Job& job = row.job;
  const std::string error_message(job.error.message());
  connection_.Run(
      "UPDATE jobs SET state = $2, started = $3, finished = $4, worker = $5, lease_until = $6, fence = $7,"
      " attempts = $8, sequence = $9, last_event = $10, chunks = $11, progress = $12, error_code = $13,"
      " error_message = $14, stored_bytes = $15, tally = $16 WHERE number = $1",
      row.number, static_cast<int>(job.state), job.started, job.finished, row.worker, row.lease_until, row.fence,
      job.attempts, job.sequence, job.last_event, job.chunks, job.progress, static_cast<int>(job.error.code()),
      Bytea{error_message}, job.stored_bytes, Bytea{job.tally});
}

void PostgresJobTable::Delete(std::int64_t number) { connection_.Run("DELETE FROM jobs WHERE number = $1", number); }

std::string PostgresJobTable::ReadBody(std::int64_t number) {
  return FirstBytes(connection_.Run("SELECT body FROM bodies WHERE job = $1", number)).value_or("");
}

std::optional<std::string> PostgresJobTable::ReadResumeState(std::int64_t number) {
  return FirstBytes(connection_.Run("SELECT state FROM resume_states WHERE job = $1", number));
}

void PostgresJobTable::SaveResumeState(std::int64_t number, const std::string& state) {
  connection_.Run(
      "INSERT INTO resume_states (job, state) VALUES ($1, $2) ON CONFLICT (job) DO UPDATE SET state = excluded.state",
      number, Bytea{state});
}

void PostgresJobTable::DropResumeState(std::int64_t number) {
  connection_.Run("DELETE FROM resume_states WHERE job = $1", number);
}

bool PostgresJobTable::AddEvent(std::int64_t number, const Event& event) {
  return connection_
             .Run(
                 "INSERT INTO events (job, sequence, time, kind, payload) VALUES ($1, $2, $3, $4, $5)"
                 " ON CONFLICT DO NOTHING",
                 number, event.sequence, event.time, static_cast<int>(event.kind), Bytea{*event.payload})
             .changed() > 0;
}

bool PostgresJobTable::AddChunk(std::int64_t number, const Chunk& chunk) {
  return connection_
             .Run(
                 "INSERT INTO chunks (job, number, begin_time, end_time, data) VALUES ($1, $2, $3, $4, $5)"
                 " ON CONFLICT DO NOTHING",
                 number, chunk.number, chunk.begin, chunk.end, Bytea{chunk.data})
             .changed() > 0;
}

std::optional<ShardRow> PostgresJobTable::FindShard(std::int64_t number, std::int64_t shard) {
  return FirstShard(connection_.Run(
      "SELECT number, worker, lease_until, fence, attempts FROM shards WHERE job = $1 AND number = $2", number, shard));
}

std::optional<ShardRow> PostgresJobTable::FindClaimableShard(std::int64_t number) {
  return FirstShard(connection_.Run(
      "SELECT number, worker, lease_until, fence, attempts FROM shards WHERE job = $1 AND lease_until < dlcs_now()"
      " ORDER BY number LIMIT 1",
      number));
}

std::string PostgresJobTable::ReadShardInput(std::int64_t number, std::int64_t shard) {
  return FirstBytes(connection_.Run("SELECT input FROM shards WHERE job = $1 AND number = $2", number, shard))
      .value_or("");
}

void PostgresJobTable::SaveShard(std::int64_t number, const ShardRow& shard) {
  connection_.Run(
      "UPDATE shards SET worker = $3, lease_until = $4, fence = $5, attempts = $6 WHERE job = $1 AND number = $2",
      number, shard.number, shard.worker, shard.lease_until, shard.fence, shard.attempts);
}

void PostgresJobTable::DropShards(std::int64_t number, std::optional<std::int64_t> shard) {
  connection_.Run("DELETE FROM shards WHERE job = $1 AND ($2 < 0 OR number = $2)", number, shard.value_or(-1));
}

}  // namespace dlcs::jobs
