// SPDX-License-Identifier: Apache-2.0
#include "server/store/sqlite/sqlite_database.h"

#include <sqlite3.h>

#include "fmt/format.h"
#include "server/store/sqlite/sqlite_schema.h"

namespace dlcs::jobs {
namespace {

// Own messages, so that an operator need not know SQLite's codes; they do not contain the path, since users see them.
absl::Status Explain(const SqliteError& error) {
  const auto unavailable = [&error](const char* what) {
    return absl::UnavailableError(fmt::format("The job store {} ({}).", what, error.what()));
  };
  switch (error.code() & 0xff) {
    case SQLITE_FULL:
      return unavailable("cannot grow: its disk is full or its size limit is reached");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return unavailable("is locked by another process");
    case SQLITE_CANTOPEN:
      return unavailable("cannot be opened: its file or folder is missing or not accessible");
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return unavailable("cannot be written: its file is read-only or was moved");
    case SQLITE_IOERR:
    case SQLITE_NOLFS:
    case SQLITE_PROTOCOL:
      return unavailable("cannot be read or written: its disk reports an error");
    case SQLITE_NOMEM:
      return unavailable("ran out of memory");
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return absl::DataLossError(
          fmt::format("The job store is damaged ({}): put a copy of it back in place.", error.what()));
    default:
      return absl::InternalError(fmt::format("The job store failed with code {} ({}).", error.code(), error.what()));
  }
}

bool IsOfTheFile(int code) {
  switch (code & 0xff) {
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
    case SQLITE_IOERR:
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return true;
    default:
      return false;
  }
}

// The settings of every connection. FULL: the log is synchronized before a commit returns.
void Configure(SqliteConnection& connection, const SqliteDatabaseOptions& options) {
  connection.Execute("PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON");
  if (options.max_bytes > 0) {
    const std::int64_t page_bytes = std::stoll(connection.Query("PRAGMA page_size"));
    connection.Execute(fmt::format("PRAGMA max_page_count = {}", options.max_bytes / page_bytes));
  }
}

void CheckPages(SqliteConnection& connection, const SqliteDatabaseOptions& options) {
  const std::int64_t bytes =
      std::stoll(connection.Query("PRAGMA page_count")) * std::stoll(connection.Query("PRAGMA page_size"));
  if (bytes > options.check_up_to_bytes) return;
  if (const std::string found = connection.Query("PRAGMA quick_check(1)"); found != "ok") {
    throw SqliteError(SQLITE_CORRUPT, found);
  }
}

}  // namespace

SqliteDatabase::~SqliteDatabase() {
  if (writer_ == nullptr || writer_->HasMoved()) return;
  try {
    writer_->Execute("PRAGMA wal_checkpoint(TRUNCATE)");
  } catch (const SqliteError&) {
    // The log remains next to the file and is read at the next start.
  }
}

absl::Status SqliteDatabase::Join(Part& part) {
  {
    std::unique_lock lock(group_mutex_);
    waiting_.push_back(&part);
    group_changed_.wait(lock, [&] { return part.done || !writing_; });
    if (!part.done) {
      writing_ = true;
      const std::vector<Part*> group = std::exchange(waiting_, {});
      lock.unlock();
      WriteGroup(group);
      lock.lock();
      writing_ = false;
      for (Part* const written : group) written->done = true;
      group_changed_.notify_all();
    }
  }
  if (part.thrown) std::rethrow_exception(part.thrown);
  return part.status;
}

void SqliteDatabase::WriteGroup(const std::vector<Part*>& parts) {
  const std::lock_guard lock(writer_mutex_);
  if (TryTogether(parts)) return;
  for (Part* const part : parts) {
    part->status = absl::OkStatus();
    part->thrown = nullptr;
    TryTogether({part});
  }
}

bool SqliteDatabase::TryTogether(const std::vector<Part*>& parts) {
  bool in_part = false;
  try {
    WriteTogether(parts, in_part);
  } catch (const SqliteError& error) {
    const absl::Status status = Failed(error, writer_);
    for (Part* const part : parts) part->status = status;
    // It is certain that nothing was committed if the error came before the commit, or if the disk was full.
    const bool is_undone = in_part || (error.code() & 0xff) == SQLITE_FULL;
    return parts.size() == 1 || !is_undone;
  } catch (...) {
    for (Part* const part : parts) part->thrown = std::current_exception();
  }
  return true;
}

void SqliteDatabase::WriteTogether(const std::vector<Part*>& parts, bool& in_part) {
  in_part = false;
  if (const absl::Status status = OpenWriter(); !status.ok()) {
    for (Part* const part : parts) part->status = status;
    return;
  }
  const bool alone = parts.size() == 1;
  SqliteTransaction transaction(*writer_);
  bool anything = false;
  for (Part* const part : parts) {
    in_part = true;
    if (!alone) writer_->Run("SAVEPOINT part");
    bool keep = false;
    try {
      keep = part->write(*writer_);
    } catch (const SqliteError&) {
      throw;
    } catch (...) {
      part->thrown = std::current_exception();
    }
    anything = anything || keep;
    if (!keep && !alone) writer_->Run("ROLLBACK TO part");
    if (!alone) writer_->Run("RELEASE part");
    in_part = false;
  }
  if (!anything) return;
  transaction.Commit();
  // A commit into a deleted file is no commit.
  CheckInPlace(*writer_);
  if (!healthy_.exchange(true)) log_.Recovered();
}

absl::Status SqliteDatabase::OpenWriter() {
  if (writer_ != nullptr) {
    CheckInPlace(*writer_);
    return absl::OkStatus();
  }
  using IfMissing = SqliteConnection::IfMissing;
  auto connection = std::make_unique<SqliteConnection>(options_.path, was_open_ ? IfMissing::kFail : IfMissing::kCreate,
                                                       options_.busy_timeout);
  // Before the first table: freed pages can then be given back to the disk.
  connection->Execute("PRAGMA auto_vacuum = INCREMENTAL");
  if (const std::string mode = connection->Query("PRAGMA journal_mode = WAL"); mode != "wal") {
    throw SqliteError(SQLITE_CANTOPEN, "no write-ahead log on this file system, but " + mode);
  }
  Configure(*connection, options_);
  CheckPages(*connection, options_);
  absl::Status status = Migrate(*connection, SqliteMigrations());
  if (!status.ok()) {
    healthy_ = false;
    log_.Failed(fmt::format("{}: {}", options_.path, std::string(status.message())));
    return status;
  }
  writer_ = std::move(connection);
  was_open_ = true;
  return absl::OkStatus();
}

absl::Status SqliteDatabase::OpenReader() {
  if (reader_ != nullptr) {
    CheckInPlace(*reader_);
    return absl::OkStatus();
  }
  {
    const std::lock_guard lock(writer_mutex_);
    if (absl::Status status = OpenWriter(); !status.ok()) return status;
  }
  auto connection =
      std::make_unique<SqliteConnection>(options_.path, SqliteConnection::IfMissing::kFail, options_.busy_timeout);
  Configure(*connection, options_);
  connection->Execute("PRAGMA query_only = ON");
  reader_ = std::move(connection);
  return absl::OkStatus();
}

void SqliteDatabase::CheckInPlace(const SqliteConnection& connection) {
  if (connection.HasMoved()) throw SqliteError(SQLITE_CANTOPEN, "the file was deleted, moved or replaced");
}

absl::Status SqliteDatabase::Failed(const SqliteError& error, std::unique_ptr<SqliteConnection>& connection) {
  healthy_ = false;
  if (IsOfTheFile(error.code())) connection.reset();
  const absl::Status status = Explain(error);
  log_.Failed(fmt::format("{}: {}", options_.path, std::string(status.message())));
  return status;
}

}  // namespace dlcs::jobs
