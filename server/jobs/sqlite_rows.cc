// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/sqlite_rows.h"

#include <memory>

#include "fmt/format.h"

namespace dlcs::jobs {

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
  job.last_event = row.Int(column++);
  return result;
}

std::optional<JobRow> FindJob(SqliteConnection& connection, const std::optional<std::string>& owner, const JobId& id) {
  const auto query = connection.Prepare("SELECT " DLCS_JOB_COLUMNS " FROM jobs WHERE id = ?1");
  query->Bind(id);
  if (!query->Step()) return std::nullopt;
  JobRow row = ReadJob(*query);
  if (owner.has_value() && row.job.owner != *owner) return std::nullopt;
  return row;
}

absl::Status NoSuchJob(const JobId& id) {
  // What was asked for may be anything: only what can be a name is repeated.
  return absl::NotFoundError(IsJobId(id) ? fmt::format("There is no job {}.", id) : "There is no job of that name.");
}

void AddEvent(SqliteConnection& connection, std::int64_t job, const Event& event) {
  const std::int64_t added =
      connection.Run("INSERT OR IGNORE INTO events (job, sequence, time, kind, payload) VALUES (?1, ?2, ?3, ?4, ?5)",
                     job, event.sequence, event.time, static_cast<int>(event.kind), Blob{*event.payload});
  if (added == 0) return;
  connection.Run("UPDATE jobs SET sequence = MAX(sequence, ?2), stored_bytes = stored_bytes + ?3 WHERE number = ?1",
                 job, event.sequence, static_cast<std::int64_t>(event.payload->size()));
}

std::int64_t EnterState(SqliteConnection& connection, std::int64_t job, JobState state, Time now) {
  const auto query = connection.Prepare("UPDATE jobs SET state = ?2 WHERE number = ?1 RETURNING sequence + 1");
  query->Bind(job, static_cast<int>(state));
  query->Step();
  const std::int64_t sequence = query->Int(0);
  query->Run();
  AddEvent(connection, job,
           {.sequence = sequence,
            .time = now,
            .kind = EventKind::kState,
            .payload = std::make_shared<const std::string>(JobStateName(state))});
  return sequence;
}

}  // namespace dlcs::jobs
