// SPDX-License-Identifier: Apache-2.0
// Uploaded problems.
#include <utility>

#include "server/store/job_transitions.h"
#include "server/store/problem_sql.h"
#include "server/store/sqlite/sqlite_job_store.h"
#include "server/store/sqlite/sqlite_job_table.h"

namespace dlcs::jobs {
namespace {

struct ProblemRow {
  std::int64_t number = 0;
  StoredProblem problem;
};

ProblemRow ReadProblemRow(const SqliteStatement& row) {
  return {.number = row.Int(0),
          .problem = {.id = row.Bytes(1),
                      .about = row.Bytes(2),
                      .bytes = row.Int(3),
                      .created = row.TimeAt(4),
                      .used = row.TimeAt(5)}};
}

std::optional<ProblemRow> FindProblem(SqliteConnection& connection, const std::string& owner, const ProblemId& id) {
  const auto query = connection.Prepare("SELECT " DLCS_PROBLEM_COLUMNS " FROM problems WHERE owner = ?1 AND id = ?2");
  query->Bind(owner, id);
  if (!query->Step()) return std::nullopt;
  return ReadProblemRow(*query);
}

absl::Status CheckRoom(SqliteConnection& connection, const NewProblem& problem, const ProblemQuota& quota) {
  const auto query = connection.Prepare("SELECT COUNT(*), TOTAL(bytes) FROM problems WHERE owner = ?1");
  query->Bind(problem.owner);
  query->Step();
  return CheckQuota(quota, query->Int(0), query->Int(1), static_cast<std::int64_t>(problem.body.size()));
}

}  // namespace

bool MarkUsed(SqliteConnection& connection, const std::string& owner, const ProblemId& id, Time now) {
  return connection.Run("UPDATE problems SET used = MAX(used, ?3) WHERE owner = ?1 AND id = ?2", owner, id, now) > 0;
}

std::int64_t DeleteUnusedProblems(SqliteConnection& connection, Time since, std::int64_t limit) {
  return connection.Run(
      "DELETE FROM problems WHERE number IN (SELECT number FROM problems WHERE used < ?1 AND NOT " DLCS_HELD
      " ORDER BY used LIMIT ?2)",
      since, limit);
}

absl::StatusOr<ProblemStore::Added> SqliteJobStore::AddProblem(const NewProblem& problem, const ProblemQuota& quota) {
  if (absl::Status valid = CheckProblemId(problem.id); !valid.ok()) return valid;
  return database_.Write([&](SqliteConnection& connection) -> absl::StatusOr<Added> {
    const Time now = clock_.Now();
    if (MarkUsed(connection, problem.owner, problem.id, now)) {
      return Added{.problem = FindProblem(connection, problem.owner, problem.id)->problem, .existed = true};
    }
    if (absl::Status room = CheckRoom(connection, problem, quota); !room.ok()) return room;
    connection.Run("INSERT INTO problems (owner, id, about, bytes, created, used) VALUES (?1, ?2, ?3, ?4, ?5, ?5)",
                   problem.owner, problem.id, Blob{problem.about}, static_cast<std::int64_t>(problem.body.size()), now);
    connection.Run("INSERT INTO problem_bodies (problem, body) VALUES (?1, ?2)", connection.LastRowId(),
                   Blob{problem.body});
    return Added{.problem = FindProblem(connection, problem.owner, problem.id)->problem, .existed = false};
  });
}

absl::StatusOr<StoredProblem> SqliteJobStore::GetProblem(const std::string& owner, const ProblemId& id) {
  return database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<StoredProblem> {
    std::optional<ProblemRow> row = FindProblem(connection, owner, id);
    if (!row.has_value()) return NoSuchProblem(id);
    return std::move(row->problem);
  });
}

absl::StatusOr<std::string> SqliteJobStore::ReadProblem(const std::string& owner, const ProblemId& id) {
  Time used;
  absl::StatusOr<std::string> body = database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<std::string> {
    const std::optional<ProblemRow> row = FindProblem(connection, owner, id);
    if (!row.has_value()) return NoSuchProblem(id);
    used = row->problem.used;
    const auto query = connection.Prepare("SELECT body FROM problem_bodies WHERE problem = ?1");
    query->Bind(row->number);
    query->Step();
    return query->Bytes(0);
  });
  // A solve of an uploaded problem should cost a read and no write.
  if (body.ok() && clock_.Now() - used > kUseIsMarkedEvery) {
    const absl::Status marked = database_.Write([&](SqliteConnection& connection) {
      MarkUsed(connection, owner, id, clock_.Now());
      return absl::OkStatus();
    });
    if (!marked.ok()) return marked;
  }
  return body;
}

absl::Status SqliteJobStore::DeleteProblem(const std::string& owner, const ProblemId& id) {
  return database_.Write([&](SqliteConnection& connection) -> absl::Status {
    const std::optional<ProblemRow> row = FindProblem(connection, owner, id);
    if (!row.has_value()) return NoSuchProblem(id);
    if (connection.Run("DELETE FROM problems WHERE number = ?1 AND NOT " DLCS_HELD, row->number) > 0) {
      return absl::OkStatus();
    }
    return ProblemIsHeld();
  });
}

absl::StatusOr<ProblemPage> SqliteJobStore::ListProblems(const std::string& owner, int page_size,
                                                         const std::string& page_token) {
  const absl::StatusOr<std::int64_t> below = BeginOfPage(page_token, page_size);
  if (!below.ok()) return below.status();
  return database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<ProblemPage> {
    const auto query = connection.Prepare(
        "SELECT " DLCS_PROBLEM_COLUMNS " FROM problems WHERE owner = ?1 AND number < ?2 ORDER BY number DESC LIMIT ?3");
    // One more than requested, to know whether there is a next page.
    query->Bind(owner, *below, page_size + std::int64_t{1});
    ProblemPage page;
    std::int64_t last = 0;
    while (query->Step()) {
      if (page.problems.size() == static_cast<std::size_t>(page_size)) {
        page.next_page_token = std::to_string(last);
        break;
      }
      ProblemRow row = ReadProblemRow(*query);
      last = row.number;
      page.problems.push_back(std::move(row.problem));
    }
    return page;
  });
}

}  // namespace dlcs::jobs
