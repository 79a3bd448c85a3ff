// SPDX-License-Identifier: Apache-2.0
// The thread that wakes watchers, so that the engine's thread does not have to.

#ifndef DLCS_SERVER_JOBS_WATCH_DISPATCHER_H_
#define DLCS_SERVER_JOBS_WATCH_DISPATCHER_H_

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/jobs/event_log.h"
#include "server/store/clock.h"

namespace dlcs::jobs {

// One thread for all logs of a server. Calls `ready` of watchers that have something to read, or whose minimum interval
// or heartbeat is due. Logs may be destroyed at any time; the dispatcher must outlive them. Wake() costs one mutex and,
// when the thread sleeps, one system call.
//
// Rounds of calls begin at least kPace apart. Where events come faster, watchers read those of one pace together, and
// the threads between the engine and a client wake once for them. An event after a pause is not delayed.
class WatchDispatcher final : public EventWaker {
 public:
  explicit WatchDispatcher(const Clock& clock);
  ~WatchDispatcher() override;

  void Wake(std::shared_ptr<EventLog> log) override;

  // Too short for a viewer to notice.
  static constexpr std::chrono::milliseconds kPace{2};

 private:
  void Run();
  // Wakes the watchers of `log` that can continue, without mutex_; sets the timer for the others.
  void Serve(const std::shared_ptr<EventLog>& log);
  void ServeDue();

  const Clock& clock_;

  // Used by the thread alone: when to check a log again, one entry per log.
  struct Timer {
    Duration due;
    std::weak_ptr<EventLog> log;
  };
  std::unordered_map<const EventLog*, Timer> timers_;
  std::set<std::pair<Duration, const EventLog*>> due_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<EventLog>> woken_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_WATCH_DISPATCHER_H_
