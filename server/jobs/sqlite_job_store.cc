// SPDX-License-Identifier: Apache-2.0
// What users do with jobs. What workers do with them is in sqlite_job_leases.cc.
#include "server/jobs/sqlite_job_store.h"

#include <utility>

#include "fmt/format.h"
#include "server/jobs/job_rules.h"
#include "server/jobs/sqlite_job_table.h"

namespace dlcs::jobs {
namespace {

constexpr int kMostDeletedAtOnce = 200;
constexpr int kPagesGivenBackAtOnce = 2000;

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
  return Write([&](JobTable& table) { return CreateJob(table, job); });
}

absl::StatusOr<std::optional<Job>> SqliteJobStore::FindRequest(const std::string& owner, const std::string& request_id,
                                                               const std::string& body_hash) {
  return Read([&](JobTable& table) { return FindRequestedJob(table, owner, request_id, body_hash); });
}

absl::StatusOr<Job> SqliteJobStore::Get(const std::optional<std::string>& owner, const JobId& id) {
  return Read([&](JobTable& table) { return VisibleJob(table.Lock(id), owner, id); });
}

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
  return Write([&](JobTable& table) { return RequestCancelOfJob(table, owner, id); });
}

absl::Status SqliteJobStore::Delete(const std::optional<std::string>& owner, const JobId& id) {
  return Write([&](JobTable& table) { return DeleteJob(table, owner, id); });
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
    SqliteJobTable table(connection, clock_);
    for (const std::int64_t number : expired) table.Delete(number);
    const std::int64_t problems =
        DeleteUnusedProblems(connection, clock_.Now() - expiry.max_unused_problem_age, kMostDeletedAtOnce);
    connection.Execute(fmt::format("PRAGMA incremental_vacuum({})", kPagesGivenBackAtOnce));
    return static_cast<int>(static_cast<std::int64_t>(expired.size()) + problems);
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
