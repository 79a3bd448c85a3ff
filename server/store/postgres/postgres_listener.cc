// SPDX-License-Identifier: Apache-2.0
#include "server/store/postgres/postgres_listener.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include "server/store/postgres/postgres_notice.h"
#include "server/store/postgres/postgres_schema.h"

namespace dlcs::jobs {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kAgain{1000};  // after a connection that failed
constexpr milliseconds kForever{-1};
constexpr int kNoSocket = -1;

}  // namespace

PostgresListener::PostgresListener(const PostgresDatabase& database, std::function<void(const JobChange&)> on_change)
    : database_(database), on_change_(std::move(on_change)), wake_(eventfd(0, EFD_CLOEXEC)) {
  thread_ = std::jthread([this](const std::stop_token& stop) { Work(stop); });
}

PostgresListener::~PostgresListener() {
  thread_.request_stop();
  const std::uint64_t one = 1;
  // Cannot fail: the counter is at 0.
  [[maybe_unused]] const ssize_t written = write(wake_, &one, sizeof one);
  thread_.join();
  close(wake_);
}

void PostgresListener::Sleep(int socket, milliseconds duration) const {
  pollfd watched[] = {{.fd = wake_, .events = POLLIN, .revents = 0}, {.fd = socket, .events = POLLIN, .revents = 0}};
  poll(watched, 2, static_cast<int>(duration.count()));
}

void PostgresListener::Work(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    try {
      const std::unique_ptr<PostgresConnection> connection = database_.Connect();
      connection->Run(std::string("LISTEN ") + kPostgresChannel);
      on_change_(JobChange());
      NoticeReader reader;
      while (!stop.stop_requested()) {
        Sleep(connection->socket(), kForever);
        for (const std::string& payload : connection->TakeNotifications()) {
          if (const std::optional<JobChange> change = reader.Read(payload)) on_change_(*change);
        }
      }
    } catch (const PostgresError&) {
      // The database is unavailable: other calls report that, and servers poll meanwhile.
      Sleep(kNoSocket, kAgain);
    }
  }
}

}  // namespace dlcs::jobs
