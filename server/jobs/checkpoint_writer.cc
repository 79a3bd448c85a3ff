// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/checkpoint_writer.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace dlcs::jobs {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstRetryPause{10};
constexpr milliseconds kLongestRetryPause{1000};

}  // namespace

CheckpointWriter::CheckpointWriter(JobStore& store) : store_(store), thread_([this] { Work(); }) {}

CheckpointWriter::~CheckpointWriter() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void CheckpointWriter::Schedule(std::weak_ptr<JobRun> run) {
  {
    const std::lock_guard lock(mutex_);
    scheduled_.push_back(std::move(run));
  }
  changed_.notify_one();
}

void CheckpointWriter::Work() {
  milliseconds pause = kFirstRetryPause;
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ending_ || !scheduled_.empty(); });
    if (ending_) return;
    const std::shared_ptr<JobRun> run = scheduled_.front().lock();
    scheduled_.pop_front();
    if (run == nullptr) continue;
    lock.unlock();
    const absl::Status status = run->Write(store_);
    if (absl::IsAborted(status)) run->Stop(StopCause::kLeaseLost);
    lock.lock();
    if (status.ok() || absl::IsAborted(status)) {
      pause = kFirstRetryPause;
    } else {
      scheduled_.push_back(run);
      changed_.wait_for(lock, pause, [this] { return ending_; });
      pause = std::min(2 * pause, kLongestRetryPause);
    }
  }
}

}  // namespace dlcs::jobs
