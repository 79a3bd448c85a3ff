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

// Script k takes a database from version k to k + 1. Never change one that was released: add the next.
std::span<const char* const> PostgresMigrations();

enum class IfMissing { kCreate, kFail };

// Brings the schema at the head of the search path to the version of the last script, each step in a transaction of its
// own under a lock shared by all servers: the first one migrates, the others wait. The version is in dlcs_schema.
// Errors: FAILED_PRECONDITION for a database made by a newer program. Throws PostgresError; 42P01 if there are no
// tables and they must not be created.
absl::Status Migrate(PostgresConnection& connection, std::span<const char* const> scripts, IfMissing if_missing);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_SCHEMA_H_
