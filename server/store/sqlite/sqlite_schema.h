// SPDX-License-Identifier: Apache-2.0
// The tables of the job store in SQLite, and their migrations.

#ifndef DLCS_SERVER_STORE_SQLITE_SQLITE_SCHEMA_H_
#define DLCS_SERVER_STORE_SQLITE_SQLITE_SCHEMA_H_

#include <span>

#include "absl/status/status.h"
#include "server/store/sqlite/sqlite.h"

namespace dlcs::jobs {

// Script k takes a database from version k to k + 1. Never change one that was released: add the next.
std::span<const char* const> SqliteMigrations();

// Brings the database to the version of the last script, each step in a transaction of its own: a crash in between
// leaves a version that exists. Its version is SQLite's user_version.
// Errors: FAILED_PRECONDITION for a database that a newer program has made. Throws SqliteError.
absl::Status Migrate(SqliteConnection& connection, std::span<const char* const> scripts);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_SQLITE_SQLITE_SCHEMA_H_
