// SPDX-License-Identifier: Apache-2.0
#include "server/store/sqlite/sqlite_schema.h"

#include <array>
#include <charconv>
#include <string>

#include "fmt/format.h"

namespace dlcs::jobs {
namespace {

// Times are microseconds since 1970. `sequence` is the mark below which numbers of events may have been used.
constexpr const char* kVersion1 = R"sql(
CREATE TABLE jobs (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  owner TEXT NOT NULL,
  request_id TEXT NOT NULL,
  body_hash BLOB NOT NULL,
  priority INTEGER NOT NULL,
  core_seconds REAL NOT NULL,
  memory_bytes INTEGER NOT NULL,
  threads INTEGER NOT NULL,
  deadline INTEGER,
  state INTEGER NOT NULL,
  created INTEGER NOT NULL,
  started INTEGER,
  finished INTEGER,
  worker TEXT NOT NULL DEFAULT '',
  lease_until INTEGER NOT NULL DEFAULT 0,
  fence INTEGER NOT NULL DEFAULT 0,
  attempts INTEGER NOT NULL DEFAULT 0,
  sequence INTEGER NOT NULL,
  chunks INTEGER NOT NULL DEFAULT 0,
  progress REAL NOT NULL DEFAULT 0,
  error_code INTEGER NOT NULL DEFAULT 0,
  error_message TEXT NOT NULL DEFAULT '',
  stored_bytes INTEGER NOT NULL
);
CREATE UNIQUE INDEX jobs_by_request ON jobs (owner, request_id) WHERE request_id <> '';
CREATE INDEX jobs_by_owner ON jobs (owner, number);
CREATE INDEX jobs_unfinished ON jobs (number) WHERE finished IS NULL;
CREATE INDEX jobs_finished ON jobs (finished, number, stored_bytes) WHERE finished IS NOT NULL;

-- Large values stand apart, so that reading a job does not walk over them.
CREATE TABLE bodies (
  job INTEGER PRIMARY KEY REFERENCES jobs (number) ON DELETE CASCADE,
  body BLOB NOT NULL
);
CREATE TABLE resume_states (
  job INTEGER PRIMARY KEY REFERENCES jobs (number) ON DELETE CASCADE,
  state BLOB NOT NULL
);
CREATE TABLE chunks (
  job INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
  number INTEGER NOT NULL,
  begin_time REAL NOT NULL,
  end_time REAL NOT NULL,
  data BLOB NOT NULL,
  PRIMARY KEY (job, number)
);
CREATE TABLE events (
  job INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
  sequence INTEGER NOT NULL,
  time INTEGER NOT NULL,
  kind INTEGER NOT NULL,
  payload BLOB NOT NULL,
  PRIMARY KEY (job, sequence)
) WITHOUT ROWID;
)sql";

// Uploaded problems. `problem` is the id of the one of its owner that a job needs; empty if it needs none.
constexpr const char* kVersion2 = R"sql(
CREATE TABLE problems (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  owner TEXT NOT NULL,
  id TEXT NOT NULL,
  about BLOB NOT NULL,
  bytes INTEGER NOT NULL,
  created INTEGER NOT NULL,
  used INTEGER NOT NULL,
  UNIQUE (owner, id)
);
CREATE INDEX problems_by_owner ON problems (owner, number);
CREATE INDEX problems_by_use ON problems (used);
CREATE TABLE problem_bodies (
  problem INTEGER PRIMARY KEY REFERENCES problems (number) ON DELETE CASCADE,
  body BLOB NOT NULL
);
ALTER TABLE jobs ADD COLUMN problem TEXT NOT NULL DEFAULT '';
CREATE INDEX jobs_holding_problems ON jobs (problem, owner) WHERE finished IS NULL AND problem <> '';
)sql";

// The description of a job, available without its body.
constexpr const char* kVersion3 = "ALTER TABLE jobs ADD COLUMN about BLOB NOT NULL DEFAULT x''";

// The shards of ensembles that are not stored yet. `tally`: what those that are stored have counted.
constexpr const char* kVersion4 = R"sql(
ALTER TABLE jobs ADD COLUMN shard_count INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN tally BLOB NOT NULL DEFAULT x'';
CREATE TABLE shards (
  job INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
  number INTEGER NOT NULL,
  worker TEXT NOT NULL DEFAULT '',
  lease_until INTEGER NOT NULL DEFAULT 0,
  fence INTEGER NOT NULL DEFAULT 0,
  attempts INTEGER NOT NULL DEFAULT 0,
  input BLOB NOT NULL,
  PRIMARY KEY (job, number)
);
CREATE INDEX shards_by_worker ON shards (worker) WHERE worker <> '';
)sql";

constexpr std::array kScripts{kVersion1, kVersion2, kVersion3, kVersion4};

}  // namespace

std::span<const char* const> SqliteMigrations() { return kScripts; }

absl::Status Migrate(SqliteConnection& connection, std::span<const char* const> scripts) {
  const auto version = [&connection] { return std::stoull(connection.Query("PRAGMA user_version")); };
  if (version() > scripts.size()) {
    return absl::FailedPreconditionError(fmt::format(
        "The job store has schema version {}, and this program knows versions up to {}: use a newer program.",
        version(), scripts.size()));
  }
  while (version() < scripts.size()) {
    SqliteTransaction transaction(connection);
    // Checked again under the lock: another server may be migrating too.
    const std::size_t from = version();
    if (from >= scripts.size()) break;
    connection.Execute(scripts[from]);
    connection.Execute(fmt::format("PRAGMA user_version = {}", from + 1));
    transaction.Commit();
  }
  return absl::OkStatus();
}

}  // namespace dlcs::jobs
