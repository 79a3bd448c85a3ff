// SPDX-License-Identifier: Apache-2.0
// An SQLite database file that may become unavailable and available again while it is used.

#ifndef DLCS_SERVER_STORE_SQLITE_SQLITE_DATABASE_H_
#define DLCS_SERVER_STORE_SQLITE_SQLITE_DATABASE_H_

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/clock.h"
#include "server/store/failure_log.h"
#include "server/store/sqlite/sqlite.h"
#include "server/store/store_timer.h"

namespace dlcs::jobs {

struct SqliteDatabaseOptions {
  std::string path;
  // How long a write waits for another process that holds the lock.
  Duration busy_timeout = std::chrono::seconds(2);
  // The file does not grow beyond this; 0: until the disk is full.
  std::int64_t max_bytes = 0;
  // A file up to this size is checked page by page when it is opened, at about 1 GB/s.
  std::int64_t check_up_to_bytes = std::int64_t{256} << 20;
  // Called for every operation, with the name of the function that calls Write() or Read(); may be empty.
  StoreTimer timer = {};
};

// Two connections: one writes, in short transactions, and one reads beside it (write-ahead log). A connection is opened
// when it is needed and closed after an error that may come from its file, so that the next call starts afresh. The
// file is created if it does not exist at the beginning. If it is missing later it is *not* created again, since its
// contents were acknowledged: calls fail until it is back.
//
// Group commit: a commit costs a flush of the disk, some ms on many, and one write is under way at a time. Writes that
// arrive meanwhile wait, and share the next transaction, each under a savepoint of its own: the number of writes per
// second does not depend on the disk, and a write waits for at most two flushes.
//
// Safe from any thread.
class SqliteDatabase {
 public:
  using Options = SqliteDatabaseOptions;
  using Connection = SqliteConnection;

  explicit SqliteDatabase(SqliteDatabaseOptions options) : options_(std::move(options)) {}
  // Moves the content of the log into the file.
  ~SqliteDatabase();

  // The result of `body(SqliteConnection&)`, an absl::Status or absl::StatusOr, in a transaction that is committed,
  // durably, when it is OK, and rolled back otherwise. `body` may run on another thread that writes at the same time,
  // and again if that was rolled back, so it must change nothing but the database. Errors of its own: UNAVAILABLE,
  // DATA_LOSS, FAILED_PRECONDITION (Migrate()), INTERNAL for broken SQL.
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
  // One caller's write.
  struct Part {
    std::function<bool(SqliteConnection&)> write;  // false: to be rolled back
    absl::Status status;                           // of opening and committing
    std::exception_ptr thrown;                     // by `write`, unless an SqliteError
    bool done = false;                             // guarded by group_mutex_
  };

  template <typename Body>
  auto WriteUntimed(Body& body) -> std::invoke_result_t<Body&, SqliteConnection&> {
    std::optional<std::invoke_result_t<Body&, SqliteConnection&>> result;
    Part part;
    part.write = [&](SqliteConnection& connection) {
      result.emplace(body(connection));
      return result->ok();
    };
    if (absl::Status status = Join(part); !status.ok()) return status;
    return *std::move(result);
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

  // Writes `part` together with the waiting ones, or lets another thread do so. Rethrows an exception of its `write`.
  absl::Status Join(Part& part);
  void WriteGroup(const std::vector<Part*>& parts);
  // Sets the results of the parts. False if nothing was written because one of them failed; then each must be tried
  // separately.
  bool TryTogether(const std::vector<Part*>& parts);
  // In one transaction. Throws SqliteError; `in_part` then says whether a part did.
  void WriteTogether(const std::vector<Part*>& parts, bool& in_part);

  absl::Status OpenWriter();
  absl::Status OpenReader();
  static void CheckInPlace(const SqliteConnection& connection);
  absl::Status Failed(const SqliteError& error, std::unique_ptr<SqliteConnection>& connection);

  const SqliteDatabaseOptions options_;
  std::atomic<bool> healthy_ = false;
  FailureLog log_;
  std::mutex group_mutex_;
  std::condition_variable group_changed_;
  std::vector<Part*> waiting_;  // for the next group
  bool writing_ = false;        // a group is under way
  std::mutex writer_mutex_;
  std::unique_ptr<SqliteConnection> writer_;
  bool was_open_ = false;    // guarded by writer_mutex_
  std::mutex reader_mutex_;  // taken before writer_mutex_ where both are
  std::unique_ptr<SqliteConnection> reader_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_SQLITE_SQLITE_DATABASE_H_
