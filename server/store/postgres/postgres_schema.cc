// SPDX-License-Identifier: Apache-2.0
#include "server/store/postgres/postgres_schema.h"

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "fmt/format.h"

namespace dlcs::jobs {
namespace {

// An arbitrary number that no other program locks.
constexpr std::int64_t kMigrationLock = 0x646c6373;
// Time limit for other servers' migrations and for a script.
constexpr std::chrono::minutes kPatience{30};

// As in SQLite; sqlite_schema.cc has the comments. Differences: text of users that may be any bytes is BYTEA, numbers
// have the one type that postgres.h reads, and the number of the last event is stored with the job. Blobs are numbers
// or already compressed, so the database does not compress them.
constexpr const char* kVersion1 = R"sql(
CREATE FUNCTION dlcs_now() RETURNS BIGINT STABLE LANGUAGE sql
  AS 'SELECT (extract(epoch FROM statement_timestamp()) * 1000000)::bigint';

CREATE TABLE jobs (
  number BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  id TEXT NOT NULL UNIQUE,
  owner TEXT NOT NULL,
  request_id BYTEA NOT NULL,
  body_hash BYTEA NOT NULL,
  priority BIGINT NOT NULL,
  core_seconds DOUBLE PRECISION NOT NULL,
  memory_bytes BIGINT NOT NULL,
  threads BIGINT NOT NULL,
  deadline BIGINT,
  state BIGINT NOT NULL,
  created BIGINT NOT NULL,
  started BIGINT,
  finished BIGINT,
  worker TEXT NOT NULL DEFAULT '',
  lease_until BIGINT NOT NULL DEFAULT 0,
  fence BIGINT NOT NULL DEFAULT 0,
  attempts BIGINT NOT NULL DEFAULT 0,
  sequence BIGINT NOT NULL DEFAULT 0,
  last_event BIGINT NOT NULL DEFAULT 0,
  chunks BIGINT NOT NULL DEFAULT 0,
  progress DOUBLE PRECISION NOT NULL DEFAULT 0,
  error_code BIGINT NOT NULL DEFAULT 0,
  error_message BYTEA NOT NULL DEFAULT '',
  stored_bytes BIGINT NOT NULL
) WITH (fillfactor = 70);
CREATE UNIQUE INDEX jobs_by_request ON jobs (owner, request_id) WHERE request_id <> '';
CREATE INDEX jobs_by_owner ON jobs (owner, number);
CREATE INDEX jobs_unfinished ON jobs (number) WHERE finished IS NULL;
CREATE INDEX jobs_finished ON jobs (finished, number, stored_bytes) WHERE finished IS NOT NULL;

CREATE TABLE bodies (
  job BIGINT PRIMARY KEY REFERENCES jobs (number) ON DELETE CASCADE,
  body BYTEA NOT NULL
);
CREATE TABLE resume_states (
  job BIGINT PRIMARY KEY REFERENCES jobs (number) ON DELETE CASCADE,
  state BYTEA NOT NULL
);
CREATE TABLE chunks (
  job BIGINT NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
  number BIGINT NOT NULL,
  begin_time DOUBLE PRECISION NOT NULL,
  end_time DOUBLE PRECISION NOT NULL,
  data BYTEA NOT NULL,
  PRIMARY KEY (job, number)
);
CREATE TABLE events (
  job BIGINT NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
  sequence BIGINT NOT NULL,
  time BIGINT NOT NULL,
  kind BIGINT NOT NULL,
  payload BYTEA NOT NULL,
  PRIMARY KEY (job, sequence)
);
ALTER TABLE bodies ALTER body SET STORAGE EXTERNAL;
ALTER TABLE resume_states ALTER state SET STORAGE EXTERNAL;
ALTER TABLE chunks ALTER data SET STORAGE EXTERNAL;

-- Heard by all servers when the change is committed.
CREATE FUNCTION dlcs_tell() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  IF NEW.state = 1 AND (TG_OP = 'INSERT' OR OLD.state <> 1) THEN
    PERFORM pg_notify('dlcs_jobs', 'q' || NEW.id);
  END IF;
  IF TG_OP = 'UPDATE' AND NEW.state = 3 AND OLD.state <> 3 THEN
    PERFORM pg_notify('dlcs_jobs', 'c' || NEW.id);
  END IF;
  IF TG_OP = 'UPDATE' AND NEW.last_event > OLD.last_event AND OLD.last_event > 0 THEN
    PERFORM pg_notify('dlcs_jobs', 'e' || NEW.id);
  END IF;
  RETURN NULL;
END $$;
CREATE TRIGGER jobs_tell AFTER INSERT OR UPDATE ON jobs FOR EACH ROW EXECUTE FUNCTION dlcs_tell();
)sql";

constexpr const char* kVersion2 = R"sql(
CREATE TABLE problems (
  number BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  owner TEXT NOT NULL,
  id TEXT NOT NULL,
  about BYTEA NOT NULL,
  bytes BIGINT NOT NULL,
  created BIGINT NOT NULL,
  used BIGINT NOT NULL,
  UNIQUE (owner, id)
);
CREATE INDEX problems_by_owner ON problems (owner, number);
CREATE INDEX problems_by_use ON problems (used);
CREATE TABLE problem_bodies (
  problem BIGINT PRIMARY KEY REFERENCES problems (number) ON DELETE CASCADE,
  body BYTEA NOT NULL
);
ALTER TABLE problem_bodies ALTER body SET STORAGE EXTERNAL;
ALTER TABLE jobs ADD COLUMN problem TEXT NOT NULL DEFAULT '';
CREATE INDEX jobs_holding_problems ON jobs (problem, owner) WHERE finished IS NULL AND problem <> '';
)sql";

constexpr const char* kVersion3 = "ALTER TABLE jobs ADD COLUMN about BYTEA NOT NULL DEFAULT ''";

constexpr const char* kVersion4 = R"sql(
ALTER TABLE jobs ADD COLUMN shard_count BIGINT NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN tally BYTEA NOT NULL DEFAULT '';
CREATE TABLE shards (
  job BIGINT NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
  number BIGINT NOT NULL,
  worker TEXT NOT NULL DEFAULT '',
  lease_until BIGINT NOT NULL DEFAULT 0,
  fence BIGINT NOT NULL DEFAULT 0,
  attempts BIGINT NOT NULL DEFAULT 0,
  input BYTEA NOT NULL,
  PRIMARY KEY (job, number)
) WITH (fillfactor = 70);
CREATE INDEX shards_by_worker ON shards (worker) WHERE worker <> '';
ALTER TABLE shards ALTER input SET STORAGE EXTERNAL;

-- As before, and of new ensembles, which are never queued as a whole.
CREATE OR REPLACE FUNCTION dlcs_tell() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  IF (NEW.state = 1 AND (TG_OP = 'INSERT' OR OLD.state <> 1)) OR (TG_OP = 'INSERT' AND NEW.shard_count > 0) THEN
    PERFORM pg_notify('dlcs_jobs', 'q' || NEW.id);
  END IF;
  IF TG_OP = 'UPDATE' AND NEW.state = 3 AND OLD.state <> 3 THEN
    PERFORM pg_notify('dlcs_jobs', 'c' || NEW.id);
  END IF;
  IF TG_OP = 'UPDATE' AND NEW.last_event > OLD.last_event AND OLD.last_event > 0 THEN
    PERFORM pg_notify('dlcs_jobs', 'e' || NEW.id);
  END IF;
  RETURN NULL;
END $$;
)sql";

// Servers notify of their changes themselves, after the commit (postgres_announcer.h). An index that names a column
// that every write changes would make each of them write to all indexes, also where the row is not in it.
constexpr const char* kVersion5 = R"sql(
DROP TRIGGER jobs_tell ON jobs;
DROP FUNCTION dlcs_tell();
DROP INDEX jobs_finished;
CREATE INDEX jobs_finished ON jobs (finished, number) WHERE finished IS NOT NULL;
)sql";

// From version 5 on, changes by programs before version 4 are noticed with the next poll.
constexpr std::array<PostgresMigration, 5> kSteps{
    {{kVersion1}, {kVersion2}, {kVersion3}, {kVersion4, true}, {kVersion5, true}}};

struct Versions {
  std::size_t needed = 0;  // by a program
  std::size_t done = 0;
};

// Absent if there are no tables.
std::optional<Versions> VersionsOf(PostgresConnection& connection) {
  if (connection.Run("SELECT 1 FROM pg_class WHERE oid = to_regclass('dlcs_schema')").empty()) return std::nullopt;
  // Earlier programs have written `version` alone.
  const PostgresRows rows =
      connection.Run("SELECT version, COALESCE((to_jsonb(dlcs_schema) ->> 'done')::bigint, version) FROM dlcs_schema");
  if (rows.empty()) return std::nullopt;
  return Versions{static_cast<std::size_t>(rows.Int(0, 0)), static_cast<std::size_t>(rows.Int(0, 1))};
}

// One step, unless another server has done it. `is_new`: nobody has used this database before.
void MigrateOnce(PostgresConnection& connection, std::span<const PostgresMigration> steps, bool is_new) {
  PostgresTransaction transaction(connection);
  connection.Execute("SET LOCAL statement_timeout = 0; SET LOCAL lock_timeout = 0");
  connection.Run("SELECT pg_advisory_xact_lock($1)", kMigrationLock);
  const std::optional<Versions> versions = VersionsOf(connection);
  if (!versions.has_value()) {
    connection.Execute(
        "CREATE TABLE IF NOT EXISTS dlcs_schema (version BIGINT NOT NULL, probed BIGINT NOT NULL DEFAULT 0);"
        "INSERT INTO dlcs_schema (version) VALUES (0)");
  }
  const auto [needed, done] = versions.value_or(Versions());
  if (done < steps.size()) {
    connection.Execute(steps[done].script);
    connection.Execute("ALTER TABLE dlcs_schema ADD COLUMN IF NOT EXISTS done BIGINT");
    const bool stays = steps[done].supports_older_servers && !is_new;
    connection.Run("UPDATE dlcs_schema SET version = $1, done = $2",
                   static_cast<std::int64_t>(stays ? needed : done + 1), static_cast<std::int64_t>(done + 1));
  }
  transaction.Commit();
}

}  // namespace

std::span<const PostgresMigration> PostgresMigrations() { return kSteps; }

absl::Status Migrate(PostgresConnection& connection, std::span<const PostgresMigration> steps, IfMissing if_missing) {
  bool is_new = false;
  for (;;) {
    const std::optional<Versions> versions = VersionsOf(connection);
    if (versions && versions->needed > steps.size()) {
      return absl::FailedPreconditionError(fmt::format(
          "The job store has schema version {}, and this program knows versions up to {}: use a newer program.",
          versions->needed, steps.size()));
    }
    if (versions && versions->done >= steps.size()) return absl::OkStatus();
    if (!versions && if_missing == IfMissing::kFail) {
      throw PostgresError("42P01", "the tables of the job store are no longer there");
    }
    is_new = is_new || !versions;
    const Duration patience = connection.set_patience(kPatience);
    MigrateOnce(connection, steps, is_new);
    connection.set_patience(patience);
  }
}

}  // namespace dlcs::jobs
