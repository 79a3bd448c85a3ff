// SPDX-License-Identifier: Apache-2.0
#include "server/store/postgres/postgres_job_store.h"

#include <utility>

#include "server/store/job_transitions.h"
#include "server/store/postgres/postgres_notice.h"
#include "server/store/postgres/postgres_schema.h"

namespace dlcs::jobs {

PostgresJobStore::PostgresJobStore(PostgresDatabaseOptions options)
    : SqlStore(std::move(options)), announcer_(database_) {}

absl::StatusOr<JobPage> PostgresJobStore::List(const JobFilter& filter, int page_size, const std::string& page_token) {
  const absl::StatusOr<std::int64_t> below = BeginOfPage(page_token, page_size);
  if (!below.ok()) return below.status();
  return database_.Read([&](PostgresConnection& connection) -> absl::StatusOr<JobPage> {
    // One more than requested, to know whether there is a next page.
    std::vector<JobRow> rows =
        ReadJobs(connection.Run("SELECT " DLCS_POSTGRES_JOB_COLUMNS
                                "FROM jobs WHERE number < $1 AND (1::bigint << state::int) & $2 <> 0"
                                " AND ($4 IS NULL OR owner = $4) ORDER BY number DESC LIMIT $3",
                                *below, MaskOf(filter.states), page_size + std::int64_t{1}, filter.owner));
    JobPage page;
    if (rows.size() > static_cast<std::size_t>(page_size)) {
      rows.pop_back();
      page.next_page_token = std::to_string(rows.back().number);
    }
    for (JobRow& row : rows) page.jobs.push_back(std::move(row.job));
    return page;
  });
}

absl::StatusOr<std::vector<Job>> PostgresJobStore::ListClaimable(int limit) {
  return database_.Read([&](PostgresConnection& connection) -> absl::StatusOr<std::vector<Job>> {
    std::vector<Job> jobs;
    for (JobRow& row : ReadJobs(connection.Run("SELECT " DLCS_POSTGRES_JOB_COLUMNS "FROM jobs WHERE " DLCS_POSTGRES_OPEN
                                               " ORDER BY number LIMIT $1",
                                               limit))) {
      jobs.push_back(std::move(row.job));
    }
    return jobs;
  });
}

absl::StatusOr<QueueDepth> PostgresJobStore::MeasureQueue() {
  return database_.Read([&](PostgresConnection& connection) -> absl::StatusOr<QueueDepth> {
    const PostgresRows rows = connection.Run(
        "SELECT COUNT(*), COALESCE(SUM(core_seconds), 0), COALESCE(dlcs_now() - MIN(created), 0) FROM"
        " (SELECT core_seconds, created FROM jobs WHERE " DLCS_POSTGRES_CLAIMABLE
        " UNION ALL SELECT core_seconds, created FROM shards JOIN jobs ON jobs.number = shards.job"
        " WHERE shards.lease_until < dlcs_now()) AS open");
    return QueueDepth{.jobs = rows.Int(0, 0), .core_seconds = rows.Real(0, 1), .oldest_age = Duration(rows.Int(0, 2))};
  });
}

absl::StatusOr<int> PostgresJobStore::ReleaseLeases(const std::string& worker) {
  return database_.Write([&](PostgresConnection& connection) -> absl::StatusOr<int> {
    return static_cast<int>(
        connection
            .Run("UPDATE jobs SET lease_until = 0 WHERE worker = $1 AND finished IS NULL AND lease_until > 0", worker)
            .changed() +
        connection.Run("UPDATE shards SET lease_until = 0 WHERE worker = $1 AND lease_until > 0", worker).changed());
  });
}

absl::StatusOr<std::vector<Event>> PostgresJobStore::ReadEvents(const JobId& id, std::int64_t after, int limit) {
  if (!IsJobId(id)) return std::vector<Event>();
  return database_.Read([&](PostgresConnection& connection) -> absl::StatusOr<std::vector<Event>> {
    const PostgresRows rows = connection.Run(
        "SELECT sequence, time, kind, payload FROM events WHERE job = (SELECT number FROM jobs WHERE id = $1)"
        " AND sequence > $2 ORDER BY sequence LIMIT $3",
        id, after, limit);
    std::vector<Event> events;
    for (int row = 0; row < rows.size(); ++row) {
      events.push_back({.sequence = rows.Int(row, 0),
                        .time = rows.TimeAt(row, 1),
                        .kind = static_cast<EventKind>(rows.Int(row, 2)),
                        .payload = std::make_shared<const std::string>(rows.Bytes(row, 3))});
    }
    return events;
  });
}

absl::StatusOr<std::vector<Chunk>> PostgresJobStore::ReadChunks(const JobId& id, std::int64_t from,
                                                                std::int64_t max_bytes) {
  if (!IsJobId(id)) return std::vector<Chunk>();
  return database_.Read([&](PostgresConnection& connection) -> absl::StatusOr<std::vector<Chunk>> {
    // Lengths are stored separately, so that only the data of selected rows are read.
    const PostgresRows rows = connection.Run(
        "SELECT number, begin_time, end_time, data FROM (SELECT chunks.*,"
        " SUM(octet_length(data)) OVER (ORDER BY number) AS total FROM chunks"
        " WHERE job = (SELECT number FROM jobs WHERE id = $1) AND number >= $2) AS counted"
        " WHERE number = $2 OR total <= $3 ORDER BY number",
        id, from, max_bytes);
    std::vector<Chunk> chunks;
    for (int row = 0; row < rows.size(); ++row) {
      chunks.push_back({.number = rows.Int(row, 0),
                        .begin = rows.Real(row, 1),
                        .end = rows.Real(row, 2),
                        .data = rows.Bytes(row, 3)});
    }
    return chunks;
  });
}

absl::StatusOr<int> PostgresJobStore::Expire(const Expiry& expiry) {
  const absl::StatusOr<int> jobs = ExpireJobs(expiry);
  if (!jobs.ok()) return jobs;
  const absl::StatusOr<int> problems = ExpireProblems(expiry);
  if (!problems.ok()) return problems;
  return *jobs + *problems;
}

absl::StatusOr<int> PostgresJobStore::ExpireJobs(const Expiry& expiry) {
  const absl::StatusOr<std::vector<std::int64_t>> expired =
      database_.Read([&](PostgresConnection& connection) -> absl::StatusOr<std::vector<std::int64_t>> {
        // Of the oldest jobs, those that are too old, or that together with more recent ones exceed the allowed size.
        // Only the sum reads every row; it is computed once a minute.
        const PostgresRows rows = connection.Run(
            "SELECT number FROM (SELECT number, finished,"
            " (SELECT SUM(stored_bytes) FROM jobs WHERE finished IS NOT NULL) + stored_bytes"
            " - SUM(stored_bytes) OVER (ORDER BY finished, number) AS left_bytes FROM (SELECT number, finished,"
            " stored_bytes FROM jobs WHERE finished IS NOT NULL ORDER BY finished, number LIMIT $3) AS oldest)"
            " AS counted WHERE finished < dlcs_now() - $1 OR left_bytes > $2 ORDER BY finished, number",
            std::int64_t{expiry.max_age.count()}, expiry.max_finished_bytes, kMaxDeletedAtOnce);
        std::vector<std::int64_t> numbers;
        for (int row = 0; row < rows.size(); ++row) numbers.push_back(rows.Int(row, 0));
        return numbers;
      });
  if (!expired.ok()) return expired.status();
  int deleted = 0;
  for (const std::int64_t number : *expired) {
    // One transaction each: a large one takes a while, and another server may be deleting the same list.
    const absl::Status status = database_.Write([&](PostgresConnection& connection) {
      deleted += static_cast<int>(
          connection
              .Run("DELETE FROM jobs WHERE number ="
                   " (SELECT number FROM jobs WHERE number = $1 AND finished IS NOT NULL FOR UPDATE SKIP LOCKED)",
                   number)
              .changed());
      return absl::OkStatus();
    });
    if (!status.ok()) return status;
  }
  return deleted;
}

void PostgresJobStore::Subscribe(std::function<void(const JobChange&)> on_change) {
  listener_.reset();
  if (!on_change) return;
  listener_ = std::make_unique<PostgresListener>(database_, [this, on_change = std::move(on_change)](auto& change) {
    const bool is_followed = change.what == JobChange::What::kFollowed;
    if (is_followed || change.what == JobChange::What::kWatched) announcer_.OnFollowed(change.job);
    if (!is_followed) on_change(change);
  });
}

void PostgresJobStore::Publish(const JobChange& change) {
  const std::vector<std::string> notices = NoticesOf(change);
  const absl::Status published = database_.Write([&](PostgresConnection& connection) {
    for (const std::string& notice : notices) {
      connection.Run("SELECT pg_notify($1, $2)", std::string(kPostgresChannel), notice);
    }
    return absl::OkStatus();
  });
  published.IgnoreError();  // healthy() reports it
}

absl::Status PostgresJobStore::Probe() {
  return database_.Write([](PostgresConnection& connection) {
    connection.Run("UPDATE dlcs_schema SET probed = dlcs_now()");
    return absl::OkStatus();
  });
}

}  // namespace dlcs::jobs
