// SPDX-License-Identifier: Apache-2.0
#include "server/store/postgres/postgres_database.h"

#include <algorithm>
#include <string_view>

#include "fmt/format.h"
#include "server/store/postgres/postgres_schema.h"

namespace dlcs::jobs {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kFirstPause{50};
constexpr milliseconds kLongestPause{1000};

struct Explanation {
  std::string_view sqlstate;  // or its first characters
  absl::StatusCode code;
  const char* text;
};

// Messages for users instead of those of the database, which may name hosts and files and are only logged. The first
// match counts.
constexpr Explanation kExplanations[] = {
    {"53100", absl::StatusCode::kUnavailable, "cannot grow: its disk is full"},
    {"53", absl::StatusCode::kUnavailable, "is short of memory or connections"},
    {"57014", absl::StatusCode::kUnavailable, "took too long to answer"},
    {"55P03", absl::StatusCode::kUnavailable, "is locked by another program"},
    {"57P", absl::StatusCode::kUnavailable, "is shutting down or starting"},
    {"25006", absl::StatusCode::kUnavailable, "cannot be written: its database is read-only"},
    {"25P03", absl::StatusCode::kUnavailable, "gave up waiting for this server"},
    {"40", absl::StatusCode::kUnavailable, "is busy with the same rows elsewhere"},
    {"42501", absl::StatusCode::kUnavailable, "cannot be used: its user lacks the rights"},
    {"42P01", absl::StatusCode::kUnavailable, "cannot be used: its tables are missing"},
    {"3F000", absl::StatusCode::kUnavailable, "cannot be used: its schema is missing"},
    {"58030", absl::StatusCode::kUnavailable, "cannot be read or written: its disk reports an error"},
    {"58P01", absl::StatusCode::kDataLoss, "is damaged: a file of it is missing"},
    {"XX001", absl::StatusCode::kDataLoss, "is damaged"},
    {"XX002", absl::StatusCode::kDataLoss, "is damaged: an index of it is"},
};

absl::Status Explain(const PostgresError& error) {
  if (error.sqlstate().empty()) return absl::UnavailableError("The job store cannot be reached.");
  for (const Explanation& known : kExplanations) {
    if (!std::string_view(error.sqlstate()).starts_with(known.sqlstate)) continue;
    return {known.code, fmt::format("The job store {} (SQLSTATE {}).", known.text, error.sqlstate())};
  }
  return absl::InternalError(fmt::format("The job store failed with SQLSTATE {}.", error.sqlstate()));
}

bool IsOfTheConnection(const PostgresError& error) {
  return error.sqlstate().empty() || error.sqlstate().starts_with("57P") || error.sqlstate().starts_with("08");
}

std::int64_t Milliseconds(Duration duration) { return std::chrono::duration_cast<milliseconds>(duration).count(); }

}  // namespace

std::unique_ptr<PostgresConnection> PostgresDatabase::Connect() const {
  auto connection = std::make_unique<PostgresConnection>(options_.address, options_.patience);
  const std::int64_t timeout = Milliseconds(options_.statement_timeout);
  // A transaction whose client is gone must not keep its locks. Commits are durable whatever the database's default is;
  // stricter settings are kept.
  connection->Execute(fmt::format(
      "SET statement_timeout = {}; SET lock_timeout = {}; SET idle_in_transaction_session_timeout = {};"
      "SELECT set_config('synchronous_commit', 'on', false) WHERE current_setting('synchronous_commit') = 'off'",
      timeout, timeout / 2, 2 * Milliseconds(options_.patience)));
  return connection;
}

absl::Status PostgresDatabase::PrepareTables(PostgresConnection& connection) {
  const IfMissing if_missing = was_open_ ? IfMissing::kFail : IfMissing::kCreate;
  if (absl::Status status = Migrate(connection, PostgresMigrations(), if_missing); !status.ok()) return status;
  was_open_ = true;
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<PostgresConnection>> PostgresDatabase::Open() {
  try {
    std::unique_ptr<PostgresConnection> connection = Connect();
    if (absl::Status status = PrepareTables(*connection); !status.ok()) {
      healthy_ = false;
      return status;
    }
    return connection;
  } catch (const PostgresError& error) {
    const std::lock_guard lock(mutex_);
    pause_ = std::clamp<Duration>(2 * pause_, kFirstPause, kLongestPause);
    next_attempt_ = steady_clock::now() + pause_;
    throw;
  }
}

absl::StatusOr<std::unique_ptr<PostgresConnection>> PostgresDatabase::Take() {
  std::unique_lock lock(mutex_);
  const auto has_connection = [this] { return !idle_.empty() || num_open_ < options_.max_connections; };
  do {
    if (!given_back_.wait_for(lock, options_.patience, has_connection)) {
      throw PostgresError("53300", "all connections of this server are busy");
    }
    if (idle_.empty()) break;
    std::unique_ptr<PostgresConnection> connection = std::move(idle_.back());
    idle_.pop_back();
    if (connection->IsAlive()) return connection;
    --num_open_;
  } while (true);
  if (steady_clock::now() < next_attempt_) return absl::UnavailableError("The job store cannot be reached.");
  ++num_open_;
  lock.unlock();
  absl::StatusOr<std::unique_ptr<PostgresConnection>> connection = absl::UnknownError("");
  try {
    connection = Open();
  } catch (const PostgresError&) {
    GiveBack(nullptr);
    throw;
  }
  if (!connection.ok()) {
    GiveBack(nullptr);
    return connection;
  }
  lock.lock();
  pause_ = Duration(0);
  return connection;
}

void PostgresDatabase::GiveBack(std::unique_ptr<PostgresConnection> connection) {
  {
    const std::lock_guard lock(mutex_);
    if (connection != nullptr && connection->IsAlive()) {
      idle_.push_back(std::move(connection));
    } else {
      --num_open_;
    }
  }
  given_back_.notify_one();
}

absl::Status PostgresDatabase::Failed(const PostgresError& error) {
  healthy_ = false;
  if (IsOfTheConnection(error)) {
    // The other connections are probably broken too.
    const std::lock_guard lock(mutex_);
    num_open_ -= static_cast<int>(idle_.size());
    idle_.clear();
  }
  log_.Failed(fmt::format("job store: {}{}{}", error.sqlstate(), error.sqlstate().empty() ? "" : " ", error.what()));
  return Explain(error);
}

}  // namespace dlcs::jobs
