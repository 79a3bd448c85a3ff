// SPDX-License-Identifier: Apache-2.0
// Sends transient events of the jobs that run here to the servers on which they are watched.

#ifndef DLCS_SERVER_JOBS_EVENT_RELAY_H_
#define DLCS_SERVER_JOBS_EVENT_RELAY_H_

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "server/jobs/event_log.h"
#include "server/store/clock.h"
#include "server/store/job_store.h"

namespace dlcs::jobs {

// A watcher of the log that passes on events that are not in the store, at intervals of at least kInterval, until kFor
// after the last request. Events that cannot be sent are left out, and watchers see a gap.
class EventRelay {
 public:
  static constexpr Duration kInterval = std::chrono::milliseconds(100);
  static constexpr Duration kFor = std::chrono::seconds(15);

  // Both must outlive it, and so must the wakers of all logs.
  EventRelay(JobStore& store, const Clock& clock);
  ~EventRelay();

  // The job `id` of `log` is watched on another server, which wants `detail`. Does not block.
  void Want(const JobId& id, std::shared_ptr<EventLog> log, const EventDetail& detail);

 private:
  struct Wanted {
    JobId id;
    std::shared_ptr<EventLog> log;
    EventDetail detail;
  };
  // Used by the thread alone.
  struct Relayed {
    std::unique_ptr<EventWatch> watch;
    EventDetail detail;
    std::int64_t durable_through = 0;  // the last durable event that the watch has passed, or a number above it
    Duration until;
  };
  // Shared with callbacks, which may outlive the relay.
  struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    bool has_work = false;
    bool ending = false;
    std::vector<Wanted> wanted;
  };

  void Work();
  void Begin(Wanted wanted);
  // Returns whether there may be more events later.
  bool PassOn(const JobId& id, Relayed& relayed);

  JobStore& store_;
  const Clock& clock_;
  const std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
  std::map<JobId, Relayed> relayed_;
  std::thread thread_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_EVENT_RELAY_H_
