// SPDX-License-Identifier: Apache-2.0
// The tables of the job store in PostgreSQL, and their migrations.

#ifndef DLCS_SERVER_STORE_POSTGRES_POSTGRES_SCHEMA_H_
#define DLCS_SERVER_STORE_POSTGRES_POSTGRES_SCHEMA_H_

#include <span>

#include "absl/status/status.h"
#include "server/store/postgres/postgres.h"

namespace dlcs::jobs {

// The channel for notifications of changes, with a letter and a job id as payload. Servers also send the messages of
// postgres_notice.h.
inline constexpr const char* kPostgresChannel = "dlcs_jobs";
inline constexpr char kPostgresQueued = 'q';
inline constexpr char kPostgresEvents = 'e';
inline constexpr char kPostgresCancelling = 'c';

// A step from one version to the next.
struct PostgresMigration {
  const char* script;
  // Servers that know only the version before can continue to work: the step removes nothing that they need.
  bool supports_older_servers = false;
};

// Step k takes a database from version k to k + 1. Never change one that was released: add the next.
std::span<const PostgresMigration> PostgresMigrations();

enum class IfMissing { kCreate, kFail };

// Brings the schema at the head of the search path to the version of the last step, or leaves it at a later version
// that this program can use. Each step has a transaction of its own under a lock shared by all servers: the first one
// migrates, the others wait. In dlcs_schema, `done` is the version, and `version` the one that a program must know: a
// step that older servers can use does not change it, unless the database is new. Errors: FAILED_PRECONDITION for a
// database that needs a newer program. Throws PostgresError; 42P01 if there are no tables and they must not be created.
absl::Status Migrate(PostgresConnection& connection, std::span<const PostgresMigration> steps, IfMissing if_missing);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_SCHEMA_H_
