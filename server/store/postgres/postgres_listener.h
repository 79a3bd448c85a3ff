// SPDX-License-Identifier: Apache-2.0
// Receives notifications of changes by other servers (LISTEN).

#ifndef DLCS_SERVER_STORE_POSTGRES_POSTGRES_LISTENER_H_
#define DLCS_SERVER_STORE_POSTGRES_POSTGRES_LISTENER_H_

#include <chrono>
#include <functional>
#include <stop_token>
#include <thread>

#include "server/store/job_store.h"
#include "server/store/postgres/postgres_database.h"

namespace dlcs::jobs {

// A thread with its own connection. Notifications are lost while the connection is broken; after reconnecting it
// reports kUnknown. The destructor waits for a running call of `on_change`.
class PostgresListener {
 public:
  // `database` must outlive it.
  PostgresListener(const PostgresDatabase& database, std::function<void(const JobChange&)> on_change);
  ~PostgresListener();

 private:
  void Work(const std::stop_token& stop);
  // Waits until `socket` is readable, `duration` is over (never if negative), or the thread has to end.
  void Sleep(int socket, std::chrono::milliseconds duration) const;

  const PostgresDatabase& database_;
  const std::function<void(const JobChange&)> on_change_;
  int wake_ = -1;  // can be read when the thread has to end
  std::jthread thread_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_LISTENER_H_
