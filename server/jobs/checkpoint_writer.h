// SPDX-License-Identifier: Apache-2.0
// The thread that writes accepted windows into the store, so that the engine never waits for a disk.

#ifndef DLCS_SERVER_JOBS_CHECKPOINT_WRITER_H_
#define DLCS_SERVER_JOBS_CHECKPOINT_WRITER_H_

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>

#include "server/jobs/job_run.h"
#include "server/store/job_store.h"

namespace dlcs::jobs {

// Data that arrive during a write are combined into the next one. A failed write is retried with increasing pauses of
// up to a second; runs whose lease is lost are stopped.
class CheckpointWriter {
 public:
  // `store` must outlive it.
  explicit CheckpointWriter(JobStore& store);
  ~CheckpointWriter();

  // `run` has something to write.
  void Schedule(std::weak_ptr<JobRun> run);

 private:
  void Work();

  JobStore& store_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::weak_ptr<JobRun>> scheduled_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_CHECKPOINT_WRITER_H_
