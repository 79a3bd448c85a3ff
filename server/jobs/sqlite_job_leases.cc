// SPDX-License-Identifier: Apache-2.0
// What workers do with jobs: claims, and all that is written under a lease.
#include <memory>
#include <utility>

#include "server/jobs/sqlite_job_store.h"
#include "server/jobs/sqlite_rows.h"

namespace dlcs::jobs {
namespace {

// True of a job that nobody is at work on.
#define DLCS_CLAIMABLE "finished IS NULL AND (state = 1 OR lease_until < ?1)"
static_assert(static_cast<int>(JobState::kQueued) == 1);

// The row of a job whose lease is `lease`, which may have run out as long as nobody else has claimed the job.
absl::StatusOr<JobRow> Held(SqliteConnection& connection, const Lease& lease) {
  std::optional<JobRow> row = FindJob(connection, std::nullopt, lease.job);
  if (!row.has_value() || row->fence != lease.fence || row->worker != lease.worker) {
    return absl::AbortedError("The lease on the job was lost: another server has it now.");
  }
  return *std::move(row);
}

bool IsRunning(JobState state) { return state == JobState::kRunning || state == JobState::kCancelling; }

absl::StatusOr<JobRow> HeldAndRunning(SqliteConnection& connection, const Lease& lease) {
  absl::StatusOr<JobRow> row = Held(connection, lease);
  if (row.ok() && !IsRunning(row->job.state)) return absl::AbortedError("The job has ended, or was given back.");
  return row;
}

std::optional<std::string> ReadBlob(SqliteConnection& connection, const char* sql, std::int64_t job) {
  const auto query = connection.Prepare(sql);
  query->Bind(job);
  if (!query->Step()) return std::nullopt;
  return query->Bytes(0);
}

void AddChunk(SqliteConnection& connection, std::int64_t job, const Chunk& chunk) {
  const std::int64_t added = connection.Run(
      "INSERT OR IGNORE INTO chunks (job, number, begin_time, end_time, data) VALUES (?1, ?2, ?3, ?4, ?5)", job,
      chunk.number, chunk.begin, chunk.end, Blob{chunk.data});
  if (added == 0) return;
  connection.Run("UPDATE jobs SET chunks = ?2, attempts = 1, stored_bytes = stored_bytes + ?3 WHERE number = ?1", job,
                 chunk.number + 1, static_cast<std::int64_t>(chunk.data.size()));
}

}  // namespace

absl::StatusOr<std::vector<Job>> SqliteJobStore::ListClaimable(int limit) {
  return database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<std::vector<Job>> {
    const auto query =
        connection.Prepare("SELECT " DLCS_JOB_COLUMNS " FROM jobs WHERE " DLCS_CLAIMABLE " ORDER BY number LIMIT ?2");
    query->Bind(clock_.Now(), limit);
    std::vector<Job> jobs;
    while (query->Step()) jobs.push_back(ReadJob(*query).job);
    return jobs;
  });
}

absl::StatusOr<std::optional<ClaimedJob>> SqliteJobStore::Claim(const std::string& worker, Duration lease,
                                                                std::span<const JobId> candidates) {
  return database_.Write([&](SqliteConnection& connection) -> absl::StatusOr<std::optional<ClaimedJob>> {
    const Time now = clock_.Now();
    for (const JobId& id : candidates) {
      const std::int64_t claimed = connection.Run(
          "UPDATE jobs SET worker = ?2, lease_until = ?3, fence = fence + 1, attempts = attempts + 1,"
          " started = COALESCE(started, ?1) WHERE id = ?4 AND " DLCS_CLAIMABLE,
          now, worker, now + lease, id);
      if (claimed == 0) continue;
      JobRow row = *FindJob(connection, std::nullopt, id);
      const JobState state = row.job.state == JobState::kCancelling ? JobState::kCancelling : JobState::kRunning;
      EnterState(connection, row.number, state, now);
      row = *FindJob(connection, std::nullopt, id);
      ClaimedJob result{
          .job = std::move(row.job),
          .lease = {.job = id, .worker = worker, .fence = row.fence},
          .body = ReadBlob(connection, "SELECT body FROM bodies WHERE job = ?1", row.number).value_or(""),
          .resume_state = ReadBlob(connection, "SELECT state FROM resume_states WHERE job = ?1", row.number)};
      return std::optional<ClaimedJob>(std::move(result));
    }
    return std::optional<ClaimedJob>();
  });
}

absl::StatusOr<int> SqliteJobStore::ReleaseLeases(const std::string& worker) {
  return database_.Write([&](SqliteConnection& connection) -> absl::StatusOr<int> {
    return static_cast<int>(connection.Run(
        "UPDATE jobs SET lease_until = 0 WHERE worker = ?1 AND finished IS NULL AND lease_until > 0", worker));
  });
}

absl::StatusOr<bool> SqliteJobStore::RenewLease(const Lease& lease, Duration duration) {
  return database_.Write([&](SqliteConnection& connection) -> absl::StatusOr<bool> {
    const absl::StatusOr<JobRow> row = HeldAndRunning(connection, lease);
    if (!row.ok()) return row.status();
    connection.Run("UPDATE jobs SET lease_until = ?2 WHERE number = ?1", row->number, clock_.Now() + duration);
    return row->job.state == JobState::kCancelling;
  });
}

absl::Status SqliteJobStore::Append(const Lease& lease, const Progress& progress) {
  return database_.Write([&](SqliteConnection& connection) -> absl::Status {
    const absl::StatusOr<JobRow> row = HeldAndRunning(connection, lease);
    if (!row.ok()) return row.status();
    std::int64_t next = row->job.chunks;
    for (const Chunk& chunk : progress.chunks) {
      if (chunk.number > next) return absl::InvalidArgumentError("Parts of the trajectory must follow one another.");
      AddChunk(connection, row->number, chunk);
      next = std::max(next, chunk.number + 1);
    }
    if (progress.state.has_value()) {
      connection.Run("INSERT OR REPLACE INTO resume_states (job, state) VALUES (?1, ?2)", row->number,
                     Blob{*progress.state});
    }
    for (const Event& event : progress.events) AddEvent(connection, row->number, event);
    connection.Run("UPDATE jobs SET sequence = MAX(sequence, ?2), progress = MAX(progress, ?3) WHERE number = ?1",
                   row->number, progress.reserve_through, progress.progress);
    return absl::OkStatus();
  });
}

absl::Status SqliteJobStore::Finish(const Lease& lease, const Outcome& outcome) {
  if (!IsFinal(outcome.state) || outcome.events.empty() || outcome.events.back().kind != EventKind::kSummary) {
    return absl::InvalidArgumentError("A job ends in a final state and with its summary.");
  }
  return database_.Write([&](SqliteConnection& connection) -> absl::Status {
    const absl::StatusOr<JobRow> row = Held(connection, lease);
    if (!row.ok()) return row.status();
    // The same again: the first answer was lost on its way.
    if (row->job.state == outcome.state) return absl::OkStatus();
    if (!IsRunning(row->job.state)) return absl::AbortedError("The job has ended, or was given back.");
    for (const Event& event : outcome.events) AddEvent(connection, row->number, event);
    connection.Run(
        "UPDATE jobs SET state = ?2, finished = ?3, error_code = ?4, error_message = ?5, sequence = ?6, progress = "
        "CASE ?2 WHEN 4 THEN 1.0 ELSE progress END, lease_until = 0 WHERE number = ?1",
        row->number, static_cast<int>(outcome.state), clock_.Now(), static_cast<int>(outcome.error.code()),
        std::string(outcome.error.message()), outcome.events.back().sequence);
    connection.Run("DELETE FROM resume_states WHERE job = ?1", row->number);
    return absl::OkStatus();
  });
}

absl::Status SqliteJobStore::Release(const Lease& lease, std::int64_t through) {
  return database_.Write([&](SqliteConnection& connection) -> absl::Status {
    const absl::StatusOr<JobRow> row = HeldAndRunning(connection, lease);
    if (!row.ok()) return row.status();
    connection.Run("UPDATE jobs SET sequence = ?2, lease_until = 0, attempts = 0 WHERE number = ?1", row->number,
                   through);
    if (row->job.state == JobState::kRunning) {
      EnterState(connection, row->number, JobState::kQueued, clock_.Now());
    }
    return absl::OkStatus();
  });
}

absl::StatusOr<std::vector<Event>> SqliteJobStore::ReadEvents(const JobId& id, std::int64_t after, int limit) {
  return database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<std::vector<Event>> {
    const auto query = connection.Prepare(
        "SELECT sequence, time, kind, payload FROM events WHERE job = (SELECT number FROM jobs WHERE id = ?1)"
        " AND sequence > ?2 ORDER BY sequence LIMIT ?3");
    query->Bind(id, after, limit);
    std::vector<Event> events;
    while (query->Step()) {
      events.push_back({.sequence = query->Int(0),
                        .time = query->TimeAt(1),
                        .kind = static_cast<EventKind>(query->Int(2)),
                        .payload = std::make_shared<const std::string>(query->Bytes(3))});
    }
    return events;
  });
}

absl::StatusOr<std::vector<Chunk>> SqliteJobStore::ReadChunks(const JobId& id, std::int64_t from,
                                                              std::int64_t max_bytes) {
  return database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<std::vector<Chunk>> {
    const auto query = connection.Prepare(
        "SELECT number, begin_time, end_time, data FROM chunks WHERE job = (SELECT number FROM jobs WHERE id = ?1)"
        " AND number >= ?2 ORDER BY number");
    query->Bind(id, from);
    std::vector<Chunk> chunks;
    std::int64_t bytes = 0;
    while (query->Step()) {
      Chunk chunk{.number = query->Int(0), .begin = query->Real(1), .end = query->Real(2), .data = query->Bytes(3)};
      bytes += static_cast<std::int64_t>(chunk.data.size());
      if (!chunks.empty() && bytes > max_bytes) break;
      chunks.push_back(std::move(chunk));
    }
    return chunks;
  });
}

}  // namespace dlcs::jobs
