// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/watch_dispatcher.h"

#include <functional>
#include <utility>

namespace dlcs::jobs {

WatchDispatcher::WatchDispatcher(const Clock& clock) : clock_(clock), thread_([this] { Run(); }) {}

WatchDispatcher::~WatchDispatcher() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void WatchDispatcher::Wake(std::shared_ptr<EventLog> log) {
  bool sleeps = false;
  {
    const std::lock_guard lock(mutex_);
    sleeps = woken_.empty();
    woken_.push_back(std::move(log));
  }
  if (sleeps) changed_.notify_one();
}

void WatchDispatcher::Run() {
  const auto something = [this] { return ending_ || !woken_.empty(); };
  std::chrono::steady_clock::time_point next_round;
  for (;;) {
    std::vector<std::shared_ptr<EventLog>> logs;
    {
      std::unique_lock lock(mutex_);
      if (due_.empty()) {
        changed_.wait(lock, something);
      } else {
        const Duration rest = due_.begin()->first - clock_.Elapsed();
        if (rest > Duration::zero()) changed_.wait_for(lock, rest, something);
      }
      changed_.wait_until(lock, next_round, [this] { return ending_; });
      if (ending_) return;
      logs.swap(woken_);
    }
    next_round = std::chrono::steady_clock::now() + kPace;
    for (const std::shared_ptr<EventLog>& log : logs) Serve(log);
    logs.clear();
    ServeDue();
  }
}

void WatchDispatcher::ServeDue() {
  const Duration now = clock_.Elapsed();
  while (!due_.empty() && due_.begin()->first <= now) {
    const auto timer = timers_.extract(due_.begin()->second);
    due_.erase(due_.begin());
    if (const std::shared_ptr<EventLog> log = timer.mapped().log.lock()) Serve(log);
  }
}

void WatchDispatcher::Serve(const std::shared_ptr<EventLog>& log) {
  std::vector<std::shared_ptr<const std::function<void()>>> ready;
  const Duration due = log->TakeReady(ready);
  if (const auto old = timers_.find(log.get()); old != timers_.end()) {
    due_.erase({old->second.due, log.get()});
    timers_.erase(old);
  }
  if (due != Duration::max()) {
    timers_.insert({log.get(), {due, log}});
    due_.insert({due, log.get()});
  }
  for (const auto& callback : ready) (*callback)();
}

}  // namespace dlcs::jobs
