// SPDX-License-Identifier: Apache-2.0
// A watcher that reads in the thread of the test and checks the order of the events.

#ifndef DLCS_TESTS_SERVER_JOBS_JOB_FOLLOWER_H_
#define DLCS_TESTS_SERVER_JOBS_JOB_FOLLOWER_H_

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/jobs/job_manager.h"

namespace dlcs::jobs::testing {

class JobFollower {
 public:
  JobFollower(JobManager& manager, const JobId& id, const EventWatchOptions& options = {}) : next_(options.after + 1) {
    auto watch = manager.Watch(std::nullopt, id, options, [bell = bell_] {
      const std::lock_guard lock(bell->mutex);
      bell->rung = true;
      bell->changed.notify_one();
    });
    if (watch.ok()) {
      watch_ = *std::move(watch);
    } else {
      error_ = watch.status();
    }
  }

  // Reads until the summary, an error, or an event for which `enough` returns true. Durable events are remembered as
  // "payload" in `durable`.
  void Read(const std::function<bool(const Event&)>& enough = [](const Event&) { return false; }) {
    const auto give_up = std::chrono::system_clock::now() + std::chrono::seconds(30);
    while (watch_ != nullptr) {
      const EventWatch::Delivery delivery = watch_->Next();
      switch (delivery.got) {
        case EventWatch::Got::kEvent:
          if (delivery.gap.has_value()) {
            EXPECT_EQ(delivery.gap->first, next_);
            next_ = delivery.gap->last + 1;
          }
          EXPECT_EQ(delivery.event.sequence, next_);
          next_ = delivery.event.sequence + 1;
          if (IsDurable(delivery.event.kind)) durable.push_back(*delivery.event.payload);
          iterates += delivery.event.kind == EventKind::kIterate;
          ended = delivery.event.kind == EventKind::kSummary;
          if (enough(delivery.event)) return;
          break;
        case EventWatch::Got::kArchived:
          error_ = watch_->Fetch();
          if (!error_.ok()) return;
          break;
        case EventWatch::Got::kHeartbeat:
          break;
        case EventWatch::Got::kNothing: {
          std::unique_lock lock(bell_->mutex);
          if (!bell_->changed.wait_until(lock, give_up, [this] { return bell_->rung; })) {
            ADD_FAILURE() << "nothing came for 30 s after number " << next_ - 1;
            return;
          }
          bell_->rung = false;
          break;
        }
        case EventWatch::Got::kEnd:
          EXPECT_TRUE(ended);
          return;
      }
    }
  }

  const absl::Status& error() const { return error_; }
  std::int64_t position() const { return next_ - 1; }

  std::vector<std::string> durable;
  int iterates = 0;
  bool ended = false;

 private:
  struct Bell {
    std::mutex mutex;
    std::condition_variable changed;
    bool rung = false;
  };
  std::shared_ptr<Bell> bell_ = std::make_shared<Bell>();
  std::unique_ptr<JobWatch> watch_;
  absl::Status error_;
  std::int64_t next_;
};

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_JOBS_JOB_FOLLOWER_H_
