// SPDX-License-Identifier: Apache-2.0
// Hears what other servers change in the job store (LISTEN).

#ifndef DLCS_SERVER_STORE_POSTGRES_POSTGRES_LISTENER_H_
#define DLCS_SERVER_STORE_POSTGRES_POSTGRES_LISTENER_H_

#include <chrono>
#include <functional>
#include <stop_token>
#include <thread>

#include "server/store/job_store.h"
#include "server/store/postgres/postgres_database.h"

namespace dlcs::jobs {

// A thread with a connection of its own. What happens while there is none is not heard; when it is back, that is told
// as kUnknown. Destruction waits for the call of `heard` that is under way.
class PostgresListener {
 public:
  // `database` must outlive it.
  PostgresListener(const PostgresDatabase& database, std::function<void(const JobChange&)> heard);
  ~PostgresListener();

 private:
  void Work(const std::stop_token& stop);
  // Until `socket` can be read, `duration` is over (never for a negative one), or the end.
  void Sleep(int socket, std::chrono::milliseconds duration) const;

  const PostgresDatabase& database_;
  const std::function<void(const JobChange&)> heard_;
  int wake_ = -1;  // can be read when the thread has to end
  std::jthread thread_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_LISTENER_H_
