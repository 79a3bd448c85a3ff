// SPDX-License-Identifier: Apache-2.0
// RAII wrappers of SQLite's C interface: connections, prepared statements, transactions.
//
// Failures throw SqliteError, so that a transaction reads as the list of its steps; sqlite_database.h turns them into
// absl::Status.

#ifndef DLCS_SERVER_STORE_SQLITE_SQLITE_H_
#define DLCS_SERVER_STORE_SQLITE_SQLITE_H_

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

#include "server/store/clock.h"

struct sqlite3;
struct sqlite3_stmt;

namespace dlcs::jobs {

class SqliteError final : public std::exception {
 public:
  SqliteError(int code, std::string text) : code_(code), text_(std::move(text)) {}
  // SQLite's result code, with its extension.
  int code() const { return code_; }
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  int code_;
  std::string text_;
};

// Bound as a BLOB. Strings are bound as TEXT, which SQLite never considers equal to a BLOB.
struct Blob {
  std::string_view bytes;
};

// A prepared statement of a connection, which must outlive it. Each text can be in use only once at a time.
class SqliteStatement {
 public:
  SqliteStatement(sqlite3* connection, sqlite3_stmt* statement) : connection_(connection), statement_(statement) {}
  ~SqliteStatement();
  SqliteStatement(const SqliteStatement&) = delete;
  SqliteStatement& operator=(const SqliteStatement&) = delete;

  // The values of ?1, ?2, ... They must live until the statement has run.
  template <typename... Values>
  SqliteStatement& Bind(const Values&... values) {
    int index = 0;
    (BindOne(++index, values), ...);
    return *this;
  }

  // Returns whether there is a row. Columns are counted from 0.
  bool Step();
  // Runs to the end. Returns the number of changed rows.
  std::int64_t Run();

  bool IsNull(int column) const;
  std::int64_t Int(int column) const;
  double Real(int column) const;
  std::string Bytes(int column) const;
  Time TimeAt(int column) const { return Time(Duration(Int(column))); }
  std::optional<Time> OptionalTime(int column) const;

 private:
  void BindOne(int index, std::int64_t value);
  void BindOne(int index, int value) { BindOne(index, std::int64_t{value}); }
  void BindOne(int index, double value);
  void BindOne(int index, const std::string& value);
  void BindOne(int index, Blob value);
  void BindOne(int index, Time value) { BindOne(index, std::int64_t{value.time_since_epoch().count()}); }
  void BindOne(int index, const std::optional<Time>& value);
  void BindOne(int index, const std::optional<std::string>& value);
  void Check(int code) const;

  sqlite3* const connection_;
  sqlite3_stmt* const statement_;
};

// For one thread at a time.
class SqliteConnection {
 public:
  enum class IfMissing { kCreate, kFail };
  SqliteConnection(const std::string& path, IfMissing if_missing, Duration busy_timeout);
  ~SqliteConnection();
  SqliteConnection(const SqliteConnection&) = delete;
  SqliteConnection& operator=(const SqliteConnection&) = delete;

  // `sql` is a literal: its statement is kept under its address.
  std::unique_ptr<SqliteStatement> Prepare(const char* sql);
  // Prepare() and Run().
  template <typename... Values>
  std::int64_t Run(const char* sql, const Values&... values) {
    return Prepare(sql)->Bind(values...).Run();
  }
  // One or more statements without parameters, not kept.
  void Execute(const std::string& sql);
  // The only value of a query without parameters, not kept.
  std::string Query(const std::string& sql);

  std::int64_t LastRowId() const;
  // The file at the path is no longer the one that was opened: it was deleted, moved or replaced.
  bool HasMoved() const;
  bool InTransaction() const;

 private:
  sqlite3* connection_ = nullptr;
  std::unordered_map<const char*, sqlite3_stmt*> statements_;
};

// Rolled back unless committed. Takes the write lock at the beginning, so that it cannot fail later because of it.
class SqliteTransaction {
 public:
  explicit SqliteTransaction(SqliteConnection& connection);
  ~SqliteTransaction();
  SqliteTransaction(const SqliteTransaction&) = delete;
  SqliteTransaction& operator=(const SqliteTransaction&) = delete;

  void Commit();

 private:
  SqliteConnection& connection_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_SQLITE_SQLITE_H_
