// SPDX-License-Identifier: Apache-2.0
// A database file that may break while it is used, and come back.

#ifndef DLCS_SERVER_JOBS_SQLITE_DATABASE_H_
#define DLCS_SERVER_JOBS_SQLITE_DATABASE_H_

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/jobs/clock.h"
#include "server/jobs/sqlite.h"
#include "server/jobs/store_timer.h"

namespace dlcs::jobs {

struct SqliteDatabaseOptions {
  std::string path;
  // How long a write waits for another process that holds the lock.
  Duration busy_timeout = std::chrono::seconds(2);
  // The file does not grow beyond this; 0: as far as the disk goes.
  std::int64_t max_bytes = 0;
  // A file up to this size is checked page by page when it is opened, at about 1 GB/s.
  std::int64_t check_up_to_bytes = std::int64_t{256} << 20;
  // Told of every operation, under the name of the function that calls Write() or Read(); may be empty.
  StoreTimer timer = {};
};

// Two connections: one writes, in short transactions, and one reads beside it (write-ahead log). A connection is opened
// when it is needed and closed after an error that may come from its file, so that the next call starts afresh. The
// file is made when there is none at the beginning; one that goes missing later is *not* made anew, since what it held
// was acknowledged: calls fail until it is back.
//
// Safe from any thread.
class SqliteDatabase {
 public:
  using Options = SqliteDatabaseOptions;
  using Connection = SqliteConnection;

  explicit SqliteDatabase(SqliteDatabaseOptions options) : options_(std::move(options)) {}
  // Folds the log into the file.
  ~SqliteDatabase();

  // The result of `body(SqliteConnection&)`, an absl::Status or absl::StatusOr, in a transaction that is committed,
  // durably, when it is OK, and rolled back otherwise. Errors of its own: UNAVAILABLE, DATA_LOSS, FAILED_PRECONDITION
  // (Migrate()), INTERNAL for broken SQL.
  template <typename Body>
  auto Write(Body&& body, const char* operation = __builtin_FUNCTION())
      -> std::invoke_result_t<Body, SqliteConnection&> {
    return Timed(options_.timer, operation, [&] { return WriteUntimed(body); });
  }

  // The same without a transaction; `body` only reads.
  template <typename Body>
  auto Read(Body&& body, const char* operation = __builtin_FUNCTION())
      -> std::invoke_result_t<Body, SqliteConnection&> {
    return Timed(options_.timer, operation, [&] { return ReadUntimed(body); });
  }

  // False after an error that is not the caller's, until something was written.
  bool healthy() const { return healthy_; }

 private:
  template <typename Body>
  auto WriteUntimed(Body& body) -> std::invoke_result_t<Body&, SqliteConnection&> {
    const std::lock_guard lock(writer_mutex_);
    try {
      if (absl::Status status = OpenWriter(); !status.ok()) return status;
      SqliteTransaction transaction(*writer_);
      auto result = body(*writer_);
      if (result.ok()) {
        transaction.Commit();
        // A commit into a deleted file is no commit.
        CheckInPlace(*writer_);
        healthy_ = true;
      }
      return result;
    } catch (const SqliteError& error) {
      return Failed(error, writer_);
    }
  }

  template <typename Body>
  auto ReadUntimed(Body& body) -> std::invoke_result_t<Body&, SqliteConnection&> {
    const std::lock_guard lock(reader_mutex_);
    try {
      if (absl::Status status = OpenReader(); !status.ok()) return status;
      return body(*reader_);
    } catch (const SqliteError& error) {
      return Failed(error, reader_);
    }
  }

  absl::Status OpenWriter();
  absl::Status OpenReader();
  static void CheckInPlace(const SqliteConnection& connection);
  absl::Status Failed(const SqliteError& error, std::unique_ptr<SqliteConnection>& connection);

  const SqliteDatabaseOptions options_;
  std::atomic<bool> healthy_ = false;
  std::mutex writer_mutex_;
  std::unique_ptr<SqliteConnection> writer_;
  bool was_open_ = false;    // with writer_mutex_
  std::mutex reader_mutex_;  // taken before writer_mutex_ where both are
  std::unique_ptr<SqliteConnection> reader_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_SQLITE_DATABASE_H_
