// SPDX-License-Identifier: Apache-2.0
#include "server/store/sqlite/sqlite.h"

#include <sqlite3.h>

#include <chrono>
#include <utility>

namespace dlcs::jobs {
namespace {

void CheckOn(sqlite3* connection, int code) {
  if (code == SQLITE_OK || code == SQLITE_ROW || code == SQLITE_DONE) return;
  throw SqliteError(code, connection == nullptr ? sqlite3_errstr(code) : sqlite3_errmsg(connection));
}

}  // namespace

SqliteStatement::~SqliteStatement() {
  // Their result is the error of the last step, which was thrown already.
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

bool SqliteStatement::Step() {
  const int code = sqlite3_step(statement_);
  Check(code);
  return code == SQLITE_ROW;
}

std::int64_t SqliteStatement::Run() {
  while (Step()) {
  }
  return sqlite3_changes64(connection_);
}

bool SqliteStatement::IsNull(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }

std::int64_t SqliteStatement::Int(int column) const { return sqlite3_column_int64(statement_, column); }

double SqliteStatement::Real(int column) const { return sqlite3_column_double(statement_, column); }

std::string SqliteStatement::Bytes(int column) const {
  // In this order, as SQLite asks: the first call may convert the value.
  const void* data = sqlite3_column_blob(statement_, column);
  const int size = sqlite3_column_bytes(statement_, column);
  return data == nullptr ? std::string() : std::string(static_cast<const char*>(data), static_cast<std::size_t>(size));
}

std::optional<Time> SqliteStatement::OptionalTime(int column) const {
  if (IsNull(column)) return std::nullopt;
  return TimeAt(column);
}

void SqliteStatement::BindOne(int index, std::int64_t value) { Check(sqlite3_bind_int64(statement_, index, value)); }

void SqliteStatement::BindOne(int index, double value) { Check(sqlite3_bind_double(statement_, index, value)); }

void SqliteStatement::BindOne(int index, const std::string& value) {
  Check(sqlite3_bind_text64(statement_, index, value.data(), value.size(), SQLITE_STATIC, SQLITE_UTF8));
}

void SqliteStatement::BindOne(int index, Blob value) {
  // A null pointer would make it NULL.
  const char* data = value.bytes.empty() ? "" : value.bytes.data();
  Check(sqlite3_bind_blob64(statement_, index, data, value.bytes.size(), SQLITE_STATIC));
}

void SqliteStatement::BindOne(int index, const std::optional<Time>& value) {
  if (value.has_value()) {
    BindOne(index, *value);
  } else {
    Check(sqlite3_bind_null(statement_, index));
  }
}

void SqliteStatement::BindOne(int index, const std::optional<std::string>& value) {
  if (value.has_value()) {
    BindOne(index, *value);
  } else {
    Check(sqlite3_bind_null(statement_, index));
  }
}

void SqliteStatement::Check(int code) const { CheckOn(connection_, code); }

SqliteConnection::SqliteConnection(const std::string& path, IfMissing if_missing, Duration busy_timeout) {
  const int create = if_missing == IfMissing::kCreate ? SQLITE_OPEN_CREATE : 0;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE | create;
  try {
    CheckOn(connection_, sqlite3_open_v2(path.c_str(), &connection_, flags, nullptr));
    const auto timeout = std::chrono::duration_cast<std::chrono::milliseconds>(busy_timeout);
    CheckOn(connection_, sqlite3_busy_timeout(connection_, static_cast<int>(timeout.count())));
    // Otherwise the last connection to a replaced file would delete the log of the new file when it closes.
    CheckOn(connection_, sqlite3_db_config(connection_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr));
  } catch (...) {
    sqlite3_close(connection_);
    throw;
  }
}

SqliteConnection::~SqliteConnection() {
  for (const auto& [sql, statement] : statements_) sqlite3_finalize(statement);
  sqlite3_close(connection_);
}

std::unique_ptr<SqliteStatement> SqliteConnection::Prepare(const char* sql) {
  sqlite3_stmt*& statement = statements_[sql];
  if (statement == nullptr) {
    CheckOn(connection_, sqlite3_prepare_v3(connection_, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr));
  }
  return std::make_unique<SqliteStatement>(connection_, statement);
}

void SqliteConnection::Execute(const std::string& sql) {
  CheckOn(connection_, sqlite3_exec(connection_, sql.c_str(), nullptr, nullptr, nullptr));
}

std::string SqliteConnection::Query(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  CheckOn(connection_, sqlite3_prepare_v2(connection_, sql.c_str(), -1, &statement, nullptr));
  const std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> owner(statement, sqlite3_finalize);
  SqliteStatement query(connection_, statement);
  return query.Step() ? query.Bytes(0) : std::string();
}

std::int64_t SqliteConnection::LastRowId() const { return sqlite3_last_insert_rowid(connection_); }

bool SqliteConnection::HasMoved() const {
  int moved = 0;
  return sqlite3_file_control(connection_, "main", SQLITE_FCNTL_HAS_MOVED, &moved) != SQLITE_OK || moved != 0;
}

bool SqliteConnection::InTransaction() const { return sqlite3_get_autocommit(connection_) == 0; }

SqliteTransaction::SqliteTransaction(SqliteConnection& connection) : connection_(connection) {
  connection_.Run("BEGIN IMMEDIATE");
}

SqliteTransaction::~SqliteTransaction() {
  if (!connection_.InTransaction()) return;
  try {
    connection_.Run("ROLLBACK");
  } catch (const SqliteError&) {
    // Then there is nothing to roll back, or the connection is about to be closed.
  }
}

void SqliteTransaction::Commit() { connection_.Run("COMMIT"); }

}  // namespace dlcs::jobs
