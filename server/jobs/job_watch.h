// SPDX-License-Identifier: Apache-2.0
// One watcher of one job, wherever its events are.

#ifndef DLCS_SERVER_JOBS_JOB_WATCH_H_
#define DLCS_SERVER_JOBS_JOB_WATCH_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "server/jobs/event_log.h"
#include "server/store/job.h"
#include "server/store/job_store.h"

namespace dlcs::jobs {

// Next() never blocks and may be called from a reaction; after kArchived, Fetch() is to be called from a thread that
// may block, and then Next() again.
class JobWatch {
 public:
  JobWatch(JobStore& store, JobId id, std::shared_ptr<EventLog> log, const EventWatchOptions& options,
           std::function<void()> ready);

  EventWatch::Delivery Next();
  bool has_more() const { return watch_.has_more(); }
  // Errors: NOT_FOUND when the job was deleted; those of the store.
  absl::Status Fetch();
  // The number to resume from.
  std::int64_t position() const { return watch_.position(); }

 private:
  JobStore& store_;
  const JobId id_;
  EventWatch watch_;
  std::int64_t archived_through_ = 0;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_JOB_WATCH_H_
