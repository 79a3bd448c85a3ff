// SPDX-License-Identifier: Apache-2.0
// RAII wrappers of libpq: connections, statements with their values, results, transactions.
//
// Failures throw PostgresError, so that a transaction reads as the list of its steps; postgres_database.h turns them
// into absl::Status.

#ifndef DLCS_SERVER_STORE_POSTGRES_POSTGRES_H_
#define DLCS_SERVER_STORE_POSTGRES_POSTGRES_H_

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/store/clock.h"

struct pg_conn;
struct pg_result;

namespace dlcs::jobs {

class PostgresError final : public std::exception {
 public:
  PostgresError(std::string sqlstate, std::string text) : sqlstate_(std::move(sqlstate)), text_(std::move(text)) {}
  // Five characters (PostgreSQL's manual, appendix A); empty if there was no response: the connection is broken, and
  // the last statement may or may not have been executed.
  const std::string& sqlstate() const { return sqlstate_; }
  // For the operator: may name hosts and users, never a password.
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  std::string sqlstate_;
  std::string text_;
};

// Sent as BYTEA; strings are sent as TEXT, which must not hold zero bytes.
struct Bytea {
  std::string_view bytes;
};

// The values of $1, $2, ... Strings and bytes are referred to, and must live until the statement has run.
class PostgresValues {
 public:
  template <typename... Values>
  explicit PostgresValues(const Values&... values) {
    (Add(values), ...);
  }

 private:
  friend class PostgresConnection;

  void Add(std::int64_t value);
  void Add(int value) { Add(std::int64_t{value}); }
  void Add(double value);
  void Add(const std::string& value);
  void Add(Bytea value);
  void Add(Time value) { Add(std::int64_t{value.time_since_epoch().count()}); }
  void Add(const std::optional<Time>& value);
  void Add(const std::optional<std::string>& value);
  void AddNumber(unsigned type, std::uint64_t bits);
  void AddPointer(unsigned type, const char* data, std::size_t size, bool is_binary);

  std::vector<unsigned> types_;
  std::vector<const char*> data_;
  std::vector<int> sizes_;
  std::vector<int> formats_;
  std::deque<std::array<char, 8>> numbers_;  // a deque, since its elements must not move
};

// All rows of a result. Supports columns of type BIGINT, DOUBLE PRECISION, TEXT and BYTEA.
class PostgresRows {
 public:
  explicit PostgresRows(pg_result* result) : result_(result, &Clear) {}

  int size() const;
  bool empty() const { return size() == 0; }
  // Rows that the statement changed.
  std::int64_t changed() const;

  bool IsNull(int row, int column) const;
  std::int64_t Int(int row, int column) const;
  double Real(int row, int column) const;
  std::string Bytes(int row, int column) const;
  Time TimeAt(int row, int column) const { return Time(Duration(Int(row, column))); }
  std::optional<Time> OptionalTime(int row, int column) const;

 private:
  static void Clear(pg_result* result);
  std::uint64_t Bits(int row, int column) const;

  std::unique_ptr<pg_result, void (*)(pg_result*)> result_;
};

// For one thread at a time.
class PostgresConnection {
  friend class PostgresTransaction;

 public:
  // `address` is what libpq takes for a database: a URI, or keyword=value pairs. Connects within about `patience`, at
  // most 5 s per host. Later it waits at most `patience` for a response of the server.
  PostgresConnection(const std::string& address, Duration patience);
  ~PostgresConnection();
  PostgresConnection(const PostgresConnection&) = delete;
  PostgresConnection& operator=(const PostgresConnection&) = delete;

  // One statement.
  template <typename... Values>
  PostgresRows Run(const std::string& sql, const Values&... values) {
    return RunWith(sql, PostgresValues(values...));
  }
  // Any number of statements, without values or rows.
  void Execute(const std::string& script);

  // Whether the connection still seems to be open, without a round trip.
  bool IsAlive();
  bool InTransaction() const;
  // The last warning since the last call; empty if there was none.
  std::string TakeWarning() { return std::exchange(warning_, {}); }

  // Call it after a read, outside of transactions. A former primary that wakes up after its standby was promoted still
  // returns old data. So if nothing was committed on this connection for a second, this function commits, which a
  // former primary cannot do if it has a synchronous standby; then it throws. Without a standby it only costs a round
  // trip.
  void Confirm();
  // Returns the previous value.
  Duration set_patience(Duration patience) { return std::exchange(patience_, patience); }

  // Of notifications. -------------------------------------------------------------------------------------------------

  // The socket, which is readable when there are notifications.
  int socket() const;
  // The payloads of the received notifications, without waiting.
  std::vector<std::string> TakeNotifications();

 private:
  PostgresRows RunWith(const std::string& sql, const PostgresValues& values);
  void Flush();
  PostgresRows Receive();
  // Waits until the socket can be read or, if `to_write`, written.
  void Wait(bool to_write);
  // Runs a statement whose commit waits for the standby.
  void RunConfirmed(const std::string& sql);
  [[noreturn]] void ThrowLost() const;
  // Receives warnings and notices from libpq.
  static void Notice(void* connection, const pg_result* notice);

  pg_conn* connection_ = nullptr;
  Duration patience_;
  std::string warning_;
  std::chrono::steady_clock::time_point confirmed_{};  // the beginning of the last commit
};

// Rolled back unless committed.
class PostgresTransaction {
 public:
  explicit PostgresTransaction(PostgresConnection& connection);
  ~PostgresTransaction();
  PostgresTransaction(const PostgresTransaction&) = delete;
  PostgresTransaction& operator=(const PostgresTransaction&) = delete;

  // Throws also where the server has committed, but gave up waiting for its synchronous standby: what the standby lacks
  // is lost with the server, so that it must not be acknowledged.
  void Commit();

 private:
  PostgresConnection& connection_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_H_
