// SPDX-License-Identifier: Apache-2.0
// What users do with jobs. What workers do with them is in sqlite_job_leases.cc.
#include "server/jobs/sqlite_job_store.h"

#include <charconv>
#include <memory>
#include <utility>

#include "fmt/format.h"
#include "server/jobs/sqlite_rows.h"

namespace dlcs::jobs {
namespace {

constexpr int kMostDeletedAtOnce = 200;
constexpr int kPagesGivenBackAtOnce = 2000;

// The number in a page token; absent when no page gave it.
std::optional<std::int64_t> ReadToken(const std::string& token) {
  std::int64_t number = 0;
  const char* end = token.data() + token.size();
  const auto [stop, error] = std::from_chars(token.data(), end, number);
  if (error != std::errc() || stop != end || number < 1) return std::nullopt;
  return number;
}

// Nothing when `request_id` is new.
absl::StatusOr<std::optional<Job>> FindRequestIn(SqliteConnection& connection, const std::string& owner,
                                                 const std::string& request_id, const std::string& body_hash) {
  if (request_id.empty()) return std::optional<Job>();
  const auto query = connection.Prepare("SELECT " DLCS_JOB_COLUMNS
                                        ", body_hash FROM jobs"
                                        " WHERE owner = ?1 AND request_id = ?2 AND request_id <> ''");
  query->Bind(owner, request_id);
  if (!query->Step()) return std::optional<Job>();
  constexpr int kHashColumn = 24;
  if (query->Bytes(kHashColumn) != body_hash) {
    return absl::AlreadyExistsError("request_id was used for another request: take a new one for this.");
  }
  return std::optional<Job>(ReadJob(*query).job);
}

void DeleteRow(SqliteConnection& connection, std::int64_t number) {
  connection.Run("DELETE FROM jobs WHERE number = ?1", number);
}

// The row numbers that `query` finds.
std::vector<std::int64_t> Numbers(SqliteStatement& query) {
  std::vector<std::int64_t> numbers;
  while (query.Step()) numbers.push_back(query.Int(0));
  return numbers;
}

}  // namespace

SqliteJobStore::SqliteJobStore(SqliteDatabaseOptions options, const Clock& clock)
    : clock_(clock), database_(std::move(options)) {}

absl::StatusOr<JobStore::Created> SqliteJobStore::Create(const NewJob& job) {
  if (!IsJobId(job.id)) return absl::InvalidArgumentError("A job's id is made by NewJobId().");
  return database_.Write([&](SqliteConnection& connection) -> absl::StatusOr<Created> {
    absl::StatusOr<std::optional<Job>> earlier = FindRequestIn(connection, job.owner, job.request_id, job.body_hash);
    if (!earlier.ok()) return earlier.status();
    if (earlier->has_value()) return Created{.job = **std::move(earlier), .existed = true};

    const Time now = clock_.Now();
    connection.Run(
        "INSERT INTO jobs (id, owner, request_id, body_hash, priority, core_seconds, memory_bytes, threads, deadline,"
        " state, created, sequence, stored_bytes) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, 0, ?12)",
        job.id, job.owner, job.request_id, Blob{job.body_hash}, job.priority, job.demand.core_seconds,
        job.demand.memory_bytes, job.demand.threads, job.deadline, static_cast<int>(JobState::kQueued), now,
        static_cast<std::int64_t>(job.body.size()));
    const std::int64_t number = connection.LastRowId();
    connection.Run("INSERT INTO bodies (job, body) VALUES (?1, ?2)", number, Blob{job.body});
    EnterState(connection, number, JobState::kQueued, now);
    return Created{.job = FindJob(connection, std::nullopt, job.id)->job, .existed = false};
  });
}

absl::StatusOr<std::optional<Job>> SqliteJobStore::FindRequest(const std::string& owner, const std::string& request_id,
                                                               const std::string& body_hash) {
  return database_.Read(
      [&](SqliteConnection& connection) { return FindRequestIn(connection, owner, request_id, body_hash); });
}

absl::StatusOr<Job> SqliteJobStore::Get(const std::optional<std::string>& owner, const JobId& id) {
  return database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<Job> {
    std::optional<JobRow> row = FindJob(connection, owner, id);
    if (!row.has_value()) return NoSuchJob(id);
    return std::move(row->job);
  });
}

absl::StatusOr<JobPage> SqliteJobStore::List(const JobFilter& filter, int page_size, const std::string& page_token) {
  std::optional<std::int64_t> below = std::numeric_limits<std::int64_t>::max();
  if (!page_token.empty()) below = ReadToken(page_token);
  if (!below.has_value() || page_size < 1) return absl::InvalidArgumentError("page_token: no page gave this one.");
  int states = filter.states.empty() ? ~0 : 0;
  for (const JobState state : filter.states) states |= 1 << static_cast<int>(state);

  return database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<JobPage> {
    // Two texts, so that each has its index.
    const auto query = filter.owner.has_value()
                           ? connection.Prepare("SELECT " DLCS_JOB_COLUMNS
                                                " FROM jobs WHERE number < ?1 AND ((1 << state) & ?2) <> 0"
                                                " AND owner = ?4 ORDER BY number DESC LIMIT ?3")
                           : connection.Prepare("SELECT " DLCS_JOB_COLUMNS
                                                " FROM jobs WHERE number < ?1 AND ((1 << state) & ?2) <> 0"
                                                " ORDER BY number DESC LIMIT ?3");
    // One more than asked for tells whether there is a next page.
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

absl::StatusOr<Job> SqliteJobStore::RequestCancel(const std::optional<std::string>& owner, const JobId& id) {
  return database_.Write([&](SqliteConnection& connection) -> absl::StatusOr<Job> {
    const std::optional<JobRow> row = FindJob(connection, owner, id);
    if (!row.has_value()) return NoSuchJob(id);
    const Time now = clock_.Now();
    if (row->job.state == JobState::kQueued) {
      const std::int64_t sequence = EnterState(connection, row->number, JobState::kCancelled, now);
      AddEvent(connection, row->number,
               {.sequence = sequence + 1,
                .time = now,
                .kind = EventKind::kSummary,
                .payload = std::make_shared<const std::string>()});
      connection.Run("UPDATE jobs SET finished = ?2 WHERE number = ?1", row->number, now);
    } else if (row->job.state == JobState::kRunning) {
      // Whoever holds the lease writes the event: numbers above the mark are theirs.
      connection.Run("UPDATE jobs SET state = ?2 WHERE number = ?1", row->number,
                     static_cast<int>(JobState::kCancelling));
    }
    return FindJob(connection, owner, id)->job;
  });
}

absl::Status SqliteJobStore::Delete(const std::optional<std::string>& owner, const JobId& id) {
  return database_.Write([&](SqliteConnection& connection) -> absl::Status {
    const std::optional<JobRow> row = FindJob(connection, owner, id);
    if (!row.has_value()) return NoSuchJob(id);
    if (!IsFinal(row->job.state)) {
      return absl::FailedPreconditionError(
          fmt::format("The job is {}: cancel it and wait for its end first.", JobStateName(row->job.state)));
    }
    DeleteRow(connection, row->number);
    return absl::OkStatus();
  });
}

absl::StatusOr<int> SqliteJobStore::Expire(const Expiry& expiry) {
  return database_.Write([&](SqliteConnection& connection) -> absl::StatusOr<int> {
    std::vector<std::int64_t> expired;
    {
      // Too old, or with those that finished later more than is allowed.
      const auto query = connection.Prepare(
          "SELECT number FROM (SELECT number, finished, SUM(stored_bytes) OVER (ORDER BY finished DESC, number DESC)"
          " AS total FROM jobs WHERE finished IS NOT NULL) WHERE finished < ?1 OR total > ?2"
          " ORDER BY finished, number LIMIT ?3");
      query->Bind(clock_.Now() - expiry.max_age, expiry.max_finished_bytes, kMostDeletedAtOnce);
      expired = Numbers(*query);
    }
    for (const std::int64_t number : expired) DeleteRow(connection, number);
    connection.Execute(fmt::format("PRAGMA incremental_vacuum({})", kPagesGivenBackAtOnce));
    return static_cast<int>(expired.size());
  });
}

absl::Status SqliteJobStore::Probe() {
  return database_.Write([](SqliteConnection& connection) {
    // The same value, but written all the same: a commit that must reach the disk.
    const std::string version = connection.Query("PRAGMA user_version");
    connection.Execute("PRAGMA user_version = " + version);
    return absl::OkStatus();
  });
}

}  // namespace dlcs::jobs
