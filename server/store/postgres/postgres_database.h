// SPDX-License-Identifier: Apache-2.0
// A PostgreSQL database that may become unavailable and available again while it is used.

#ifndef DLCS_SERVER_STORE_POSTGRES_POSTGRES_DATABASE_H_
#define DLCS_SERVER_STORE_POSTGRES_POSTGRES_DATABASE_H_

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/clock.h"
#include "server/store/failure_log.h"
#include "server/store/postgres/postgres.h"
#include "server/store/store_timer.h"

namespace dlcs::jobs {

struct PostgresDatabaseOptions {
  // What libpq takes for a database: postgresql://user@host:port/name?sslmode=verify-full, keyword=value pairs, ...
  std::string address;
  // Concurrent connections, not counting the one that listens; if all are busy a call waits.
  int max_connections = 8;
  // Time limit of one statement on the server. The limit for waiting for a lock is half of it.
  Duration statement_timeout = std::chrono::seconds(10);
  // Time limit for connecting, for a free connection, and for a response of the server.
  Duration patience = std::chrono::seconds(15);
  // Called for every operation, with the name of the function that calls Write() or Read(); may be empty.
  StoreTimer timer = {};
};

// A pool of connections, made when they are needed. One that fails is closed; when no connection can be made, calls
// fail at once for a moment that doubles up to a second, and then it is tried again. The first connection creates the
// tables or migrates them to this program's version. If they are missing later they are *not* created again, since
// their contents were acknowledged.
//
// Safe from any thread.
class PostgresDatabase {
 public:
  using Options = PostgresDatabaseOptions;
  using Connection = PostgresConnection;

  explicit PostgresDatabase(PostgresDatabaseOptions options) : options_(std::move(options)) {}

  // The result of `body(PostgresConnection&)`, an absl::Status or absl::StatusOr, in a transaction that is committed,
  // durably, when it is OK, and rolled back otherwise. Errors of its own: UNAVAILABLE, DATA_LOSS, FAILED_PRECONDITION
  // (Migrate()), INTERNAL for broken SQL. After UNAVAILABLE the transaction may still have been committed.
  template <typename Body>
  auto Write(Body&& body, const char* operation = __builtin_FUNCTION())
      -> std::invoke_result_t<Body, PostgresConnection&> {
    const auto in_transaction = [&](PostgresConnection& connection) {
      auto result = [&] {
        PostgresTransaction transaction(connection);
        auto done = body(connection);
        if (done.ok()) {
          transaction.Commit();
          if (!healthy_.exchange(true)) log_.Recovered();
        }
        return done;
      }();
      if (!result.ok()) connection.Confirm();
      return result;
    };
    return Timed(options_.timer, operation, [&] { return With(in_transaction); });
  }

  // The same without a transaction; `body` only reads. What it has read is at most a second old, also where another
  // server has become the primary (PostgresConnection::Confirm()); so is the reason why Write() did nothing.
  template <typename Body>
  auto Read(Body&& body, const char* operation = __builtin_FUNCTION())
      -> std::invoke_result_t<Body, PostgresConnection&> {
    const auto confirmed = [&](PostgresConnection& connection) {
      auto result = body(connection);
      connection.Confirm();
      return result;
    };
    return Timed(options_.timer, operation, [&] { return With(confirmed); });
  }

  // A connection of the caller's own, set up as those of the pool are. Throws PostgresError.
  std::unique_ptr<PostgresConnection> Connect() const;

  // False after an error that is not the caller's, until something was written.
  bool healthy() const { return healthy_; }

 private:
  // Returns its connection to the pool when it is destroyed.
  class PooledConnection {
   public:
    PooledConnection(PostgresDatabase& database, std::unique_ptr<PostgresConnection> connection)
        : database_(database), connection_(std::move(connection)) {}
    ~PooledConnection() { database_.GiveBack(std::move(connection_)); }
    PooledConnection(const PooledConnection&) = delete;
    PooledConnection& operator=(const PooledConnection&) = delete;
    PostgresConnection& operator*() const { return *connection_; }

   private:
    PostgresDatabase& database_;
    std::unique_ptr<PostgresConnection> connection_;
  };

  template <typename Body>
  auto With(Body&& body) -> std::invoke_result_t<Body, PostgresConnection&> {
    try {
      absl::StatusOr<std::unique_ptr<PostgresConnection>> connection = Take();
      if (!connection.ok()) return connection.status();
      const PooledConnection pooled(*this, *std::move(connection));
      return body(*pooled);
    } catch (const PostgresError& error) {
      return Failed(error);
    }
  }

  absl::StatusOr<std::unique_ptr<PostgresConnection>> Take();
  absl::StatusOr<std::unique_ptr<PostgresConnection>> Open();
  absl::Status PrepareTables(PostgresConnection& connection);
  // Returns a connection to the pool; closes it if it is broken.
  void GiveBack(std::unique_ptr<PostgresConnection> connection);
  absl::Status Failed(const PostgresError& error);

  const PostgresDatabaseOptions options_;
  std::atomic<bool> healthy_ = false;
  std::atomic<bool> was_open_ = false;
  FailureLog log_;

  std::mutex mutex_;
  std::condition_variable given_back_;
  std::vector<std::unique_ptr<PostgresConnection>> idle_;
  int num_open_ = 0;  // idle, pooled, or being made
  std::chrono::steady_clock::time_point next_attempt_{};
  Duration pause_{0};
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_DATABASE_H_
