// SPDX-License-Identifier: Apache-2.0
#include "server/store/sqlite/sqlite_job_store.h"

#include <memory>
#include <utility>

#include "fmt/format.h"
#include "server/store/job_transitions.h"

namespace dlcs::jobs {
namespace {

constexpr int kPagesGivenBackAtOnce = 2000;

// The row numbers that `query` finds.
std::vector<std::int64_t> Numbers(SqliteStatement& query) {
  std::vector<std::int64_t> numbers;
  while (query.Step()) numbers.push_back(query.Int(0));
  return numbers;
}

}  // namespace

SqliteJobStore::SqliteJobStore(SqliteDatabaseOptions options, const Clock& clock)
    : SqlStore(std::move(options)), clock_(clock) {}

absl::StatusOr<JobPage> SqliteJobStore::List(const JobFilter& filter, int page_size, const std::string& page_token) {
  const absl::StatusOr<std::int64_t> below = BeginOfPage(page_token, page_size);
  if (!below.ok()) return below.status();
  const std::int64_t states = MaskOf(filter.states);
  return database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<JobPage> {
    // Two texts, so that each has its index.
    const auto query = filter.owner.has_value()
                           ? connection.Prepare("SELECT " DLCS_JOB_COLUMNS
                                                " FROM jobs WHERE number < ?1 AND ((1 << state) & ?2) <> 0"
                                                " AND owner = ?4 ORDER BY number DESC LIMIT ?3")
                           : connection.Prepare("SELECT " DLCS_JOB_COLUMNS
                                                " FROM jobs WHERE number < ?1 AND ((1 << state) & ?2) <> 0"
                                                " ORDER BY number DESC LIMIT ?3");
    // One more than requested, to know whether there is a next page.
    if (filter.owner.has_value()) {
      query->Bind(*below, states, page_size + std::int64_t{1}, *filter.owner);
    } else {
      query->Bind(*below, states, page_size + std::int64_t{1});
    }
    JobPage page;
    std::int64_t last = 0;
    while (query->Step()) {
      if (page.jobs.size() == static_cast<std::size_t>(page_size)) {
        page.next_page_token = std::to_string(last);
        break;
      }
      JobRow row = ReadJob(*query);
      last = row.number;
      page.jobs.push_back(std::move(row.job));
    }
    return page;
  });
}

absl::StatusOr<std::vector<Job>> SqliteJobStore::ListClaimable(int limit) {
  return database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<std::vector<Job>> {
    const auto query =
        connection.Prepare("SELECT " DLCS_JOB_COLUMNS " FROM jobs WHERE " DLCS_OPEN " ORDER BY number LIMIT ?2");
    query->Bind(clock_.Now(), limit);
    std::vector<Job> jobs;
    while (query->Step()) jobs.push_back(ReadJob(*query).job);
    return jobs;
  });
}

absl::StatusOr<QueueDepth> SqliteJobStore::MeasureQueue() {
  return database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<QueueDepth> {
    const auto query = connection.Prepare(
        "SELECT COUNT(*), TOTAL(core_seconds), ?1 - COALESCE(MIN(created), ?1) FROM"
        " (SELECT core_seconds, created FROM jobs WHERE " DLCS_CLAIMABLE
        " UNION ALL SELECT core_seconds, created FROM shards JOIN jobs ON jobs.number = shards.job"
        " WHERE shards.lease_until < ?1)");
    query->Bind(clock_.Now());
    if (!query->Step()) return QueueDepth();
    return QueueDepth{.jobs = query->Int(0), .core_seconds = query->Real(1), .oldest_age = Duration(query->Int(2))};
  });
}

absl::StatusOr<int> SqliteJobStore::ReleaseLeases(const std::string& worker) {
  return database_.Write([&](SqliteConnection& connection) -> absl::StatusOr<int> {
    return static_cast<int>(
        connection.Run("UPDATE jobs SET lease_until = 0 WHERE worker = ?1 AND finished IS NULL AND lease_until > 0",
                       worker) +
        connection.Run("UPDATE shards SET lease_until = 0 WHERE worker = ?1 AND lease_until > 0", worker));
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

absl::StatusOr<int> SqliteJobStore::Expire(const Expiry& expiry) {
  return database_.Write([&](SqliteConnection& connection) -> absl::StatusOr<int> {
    std::vector<std::int64_t> expired;
    {
      // Jobs that are too old, or that together with more recent ones exceed the allowed size.
      const auto query = connection.Prepare(
          "SELECT number FROM (SELECT number, finished, SUM(stored_bytes) OVER (ORDER BY finished DESC, number DESC)"
          " AS total FROM jobs WHERE finished IS NOT NULL) WHERE finished < ?1 OR total > ?2"
          " ORDER BY finished, number LIMIT ?3");
      query->Bind(clock_.Now() - expiry.max_age, expiry.max_finished_bytes, kMaxDeletedAtOnce);
      expired = Numbers(*query);
    }
    SqliteJobTable table(connection, clock_);
    for (const std::int64_t number : expired) table.Delete(number);
    const std::int64_t problems =
        DeleteUnusedProblems(connection, clock_.Now() - expiry.max_unused_problem_age, kMaxDeletedAtOnce);
    connection.Execute(fmt::format("PRAGMA incremental_vacuum({})", kPagesGivenBackAtOnce));
    return static_cast<int>(static_cast<std::int64_t>(expired.size()) + problems);
  });
}

absl::Status SqliteJobStore::Probe() {
  return database_.Write([](SqliteConnection& connection) {
    // Writes the same value, so that there is a commit that must reach the disk.
    const std::string version = connection.Query("PRAGMA user_version");
    connection.Execute("PRAGMA user_version = " + version);
    return absl::OkStatus();
  });
}

}  // namespace dlcs::jobs
