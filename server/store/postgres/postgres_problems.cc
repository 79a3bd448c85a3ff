// SPDX-License-Identifier: Apache-2.0
// Uploaded problems.
#include <utility>

#include "server/store/job_transitions.h"
#include "server/store/postgres/postgres_job_store.h"
#include "server/store/postgres/postgres_job_table.h"
#include "server/store/problem_sql.h"

namespace dlcs::jobs {
namespace {

StoredProblem ReadProblemRow(const PostgresRows& rows, int row) {
  return {.id = rows.Bytes(row, 1),
          .about = rows.Bytes(row, 2),
          .bytes = rows.Int(row, 3),
          .created = rows.TimeAt(row, 4),
          .used = rows.TimeAt(row, 5)};
}

absl::StatusOr<StoredProblem> FindProblem(PostgresConnection& connection, const std::string& owner,
                                          const ProblemId& id) {
  if (!IsProblemId(id)) return NoSuchProblem(id);  // callers may send any bytes, which TEXT cannot hold
  const PostgresRows rows =
      connection.Run("SELECT " DLCS_PROBLEM_COLUMNS " FROM problems WHERE owner = $1 AND id = $2", owner, id);
  if (rows.empty()) return NoSuchProblem(id);
  return ReadProblemRow(rows, 0);
}

// The quota of one user is checked by one transaction at a time.
absl::Status CheckRoom(PostgresConnection& connection, const NewProblem& problem, const ProblemQuota& quota) {
  connection.Run("SELECT pg_advisory_xact_lock(hashtextextended($1, 0))", "dlcs problems of " + problem.owner);
  const PostgresRows held =
      connection.Run("SELECT COUNT(*), COALESCE(SUM(bytes), 0)::bigint FROM problems WHERE owner = $1", problem.owner);
  return CheckQuota(quota, held.Int(0, 0), held.Int(0, 1), static_cast<std::int64_t>(problem.body.size()));
}

}  // namespace

bool MarkUsed(PostgresConnection& connection, const std::string& owner, const std::string& id) {
  return IsProblemId(id) &&
         connection.Run("UPDATE problems SET used = GREATEST(used, dlcs_now()) WHERE owner = $1 AND id = $2", owner, id)
                 .changed() > 0;
}

absl::StatusOr<ProblemStore::Added> PostgresJobStore::AddProblem(const NewProblem& problem, const ProblemQuota& quota) {
  if (absl::Status valid = CheckProblemId(problem.id); !valid.ok()) return valid;
  return database_.Write([&](PostgresConnection& connection) -> absl::StatusOr<Added> {
    bool existed = MarkUsed(connection, problem.owner, problem.id);
    if (!existed) {
      const absl::Status room = CheckRoom(connection, problem, quota);
      existed = MarkUsed(connection, problem.owner, problem.id);  // by who held the lock before
      if (!existed && !room.ok()) return room;
    }
    if (!existed) {
      const PostgresRows added = connection.Run(
          "INSERT INTO problems (owner, id, about, bytes, created, used)"
          " VALUES ($1, $2, $3, $4, dlcs_now(), dlcs_now()) RETURNING number",
          problem.owner, problem.id, Bytea{problem.about}, static_cast<std::int64_t>(problem.body.size()));
      connection.Run("INSERT INTO problem_bodies (problem, body) VALUES ($1, $2)", added.Int(0, 0),
                     Bytea{problem.body});
    }
    absl::StatusOr<StoredProblem> stored = FindProblem(connection, problem.owner, problem.id);
    if (!stored.ok()) return stored.status();
    return Added{.problem = *std::move(stored), .existed = existed};
  });
}

absl::StatusOr<StoredProblem> PostgresJobStore::GetProblem(const std::string& owner, const ProblemId& id) {
  return database_.Read([&](PostgresConnection& connection) { return FindProblem(connection, owner, id); });
}

absl::StatusOr<std::string> PostgresJobStore::ReadProblem(const std::string& owner, const ProblemId& id) {
  if (!IsProblemId(id)) return NoSuchProblem(id);
  bool is_to_be_marked = false;
  absl::StatusOr<std::string> body = database_.Read([&](PostgresConnection& connection) -> absl::StatusOr<std::string> {
    const PostgresRows rows = connection.Run(
        "SELECT body, dlcs_now() - used FROM problems JOIN problem_bodies ON problem = number"
        " WHERE owner = $1 AND id = $2",
        owner, id);
    if (rows.empty()) return NoSuchProblem(id);
    is_to_be_marked = Duration(rows.Int(0, 1)) > kUseIsMarkedEvery;
    return rows.Bytes(0, 0);
  });
  // A solve of an uploaded problem should cost a read and no write.
  if (body.ok() && is_to_be_marked) {
    const absl::Status marked = database_.Write([&](PostgresConnection& connection) {
      MarkUsed(connection, owner, id);
      return absl::OkStatus();
    });
    if (!marked.ok()) return marked;
  }
  return body;
}

absl::Status PostgresJobStore::DeleteProblem(const std::string& owner, const ProblemId& id) {
  if (!IsProblemId(id)) return NoSuchProblem(id);
  return database_.Write([&](PostgresConnection& connection) -> absl::Status {
    // Creating a job for it locks it first.
    const PostgresRows locked =
        connection.Run("SELECT number FROM problems WHERE owner = $1 AND id = $2 FOR UPDATE", owner, id);
    if (locked.empty()) return NoSuchProblem(id);
    if (connection.Run("DELETE FROM problems WHERE number = $1 AND NOT " DLCS_HELD, locked.Int(0, 0)).changed() > 0) {
      return absl::OkStatus();
    }
    return ProblemIsHeld();
  });
}

absl::StatusOr<ProblemPage> PostgresJobStore::ListProblems(const std::string& owner, int page_size,
                                                           const std::string& page_token) {
  const absl::StatusOr<std::int64_t> below = BeginOfPage(page_token, page_size);
  if (!below.ok()) return below.status();
  return database_.Read([&](PostgresConnection& connection) -> absl::StatusOr<ProblemPage> {
    // One more than requested, to know whether there is a next page.
    const PostgresRows rows = connection.Run(
        "SELECT " DLCS_PROBLEM_COLUMNS " FROM problems WHERE owner = $1 AND number < $2 ORDER BY number DESC LIMIT $3",
        owner, *below, page_size + std::int64_t{1});
    ProblemPage page;
    for (int row = 0; row < rows.size() && row < page_size; ++row) page.problems.push_back(ReadProblemRow(rows, row));
    if (rows.size() > page_size) page.next_page_token = std::to_string(rows.Int(page_size - 1, 0));
    return page;
  });
}

absl::StatusOr<int> PostgresJobStore::ExpireProblems(const Expiry& expiry) {
  const std::int64_t age = expiry.max_unused_problem_age.count();
  const absl::StatusOr<std::vector<std::int64_t>> unused =
      database_.Read([&](PostgresConnection& connection) -> absl::StatusOr<std::vector<std::int64_t>> {
        const PostgresRows rows = connection.Run(
            "SELECT number FROM problems WHERE used < dlcs_now() - $1 AND NOT " DLCS_HELD " ORDER BY used LIMIT $2",
            age, kMaxDeletedAtOnce);
        std::vector<std::int64_t> numbers;
        for (int row = 0; row < rows.size(); ++row) numbers.push_back(rows.Int(row, 0));
        return numbers;
      });
  if (!unused.ok()) return unused.status();
  int deleted = 0;
  for (const std::int64_t number : *unused) {
    const absl::Status status = database_.Write([&](PostgresConnection& connection) {
      // Problems that were used since the list was made, or are being used now, are kept.
      const PostgresRows locked = connection.Run(
          "SELECT number FROM problems WHERE number = $1 AND used < dlcs_now() - $2 FOR UPDATE SKIP LOCKED", number,
          age);
      if (locked.empty()) return absl::OkStatus();
      deleted += static_cast<int>(
          connection.Run("DELETE FROM problems WHERE number = $1 AND NOT " DLCS_HELD, number).changed());
      return absl::OkStatus();
    });
    if (!status.ok()) return status;
  }
  return deleted;
}

}  // namespace dlcs::jobs
