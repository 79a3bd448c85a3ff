// SPDX-License-Identifier: Apache-2.0
// What workers do with jobs, and how their work is read.
#include <memory>
#include <utility>

#include "server/jobs/job_rules.h"
#include "server/jobs/sqlite_job_store.h"

namespace dlcs::jobs {

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
  return Write([&](JobTable& table) { return ClaimJob(table, worker, lease, candidates); });
}

absl::StatusOr<int> SqliteJobStore::ReleaseLeases(const std::string& worker) {
  return database_.Write([&](SqliteConnection& connection) -> absl::StatusOr<int> {
    return static_cast<int>(connection.Run(
        "UPDATE jobs SET lease_until = 0 WHERE worker = ?1 AND finished IS NULL AND lease_until > 0", worker));
  });
}

absl::StatusOr<bool> SqliteJobStore::RenewLease(const Lease& lease, Duration duration) {
  return Write([&](JobTable& table) { return RenewLeaseOfJob(table, lease, duration); });
}

absl::Status SqliteJobStore::Append(const Lease& lease, const Progress& progress) {
  return Write([&](JobTable& table) { return AppendToJob(table, lease, progress); });
}

absl::Status SqliteJobStore::Finish(const Lease& lease, const Outcome& outcome) {
  return Write([&](JobTable& table) { return FinishJob(table, lease, outcome); });
}

absl::Status SqliteJobStore::Release(const Lease& lease, std::int64_t through) {
  return Write([&](JobTable& table) { return ReleaseJob(table, lease, through); });
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
