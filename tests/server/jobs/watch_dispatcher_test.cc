// SPDX-License-Identifier: Apache-2.0
// Watchers in threads of their own; also for the thread sanitizer.
#include "server/jobs/watch_dispatcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/jobs/event_log.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using Got = EventWatch::Got;

// Reads like a reactor: until there is nothing more, and again when it is called.
class Reader {
 public:
  Reader(std::shared_ptr<EventLog> log, const EventWatchOptions& options)
      : bell_(std::make_shared<Bell>()), watch_(std::move(log), options, [bell = bell_] {
          const std::lock_guard lock(bell->mutex);
          bell->rung = true;
          bell->changed.notify_one();
        }) {}

  void ReadToEnd() {
    for (;;) {
      const EventWatch::Delivery delivery = watch_.Next();
      switch (delivery.got) {
        case Got::kEvent:
          if (delivery.gap.has_value()) {
            consecutive_ = consecutive_ && delivery.gap->first == next_;
            next_ = delivery.gap->last + 1;
            ++gaps_;
          }
          consecutive_ = consecutive_ && delivery.event.sequence == next_;
          ++next_;
          windows_ += delivery.event.kind == EventKind::kWindowAccepted;
          ages_.push_back(SystemClock().Now() - delivery.event.time);
          break;
        case Got::kHeartbeat:
          ++heartbeats_;
          break;
        case Got::kNothing: {
          std::unique_lock lock(bell_->mutex);
          bell_->changed.wait(lock, [this] { return bell_->rung; });
          bell_->rung = false;
          break;
        }
        case Got::kArchived:
          ADD_FAILURE() << "the log was large enough";
          return;
        case Got::kEnd:
          return;
      }
    }
  }

  bool consecutive() const { return consecutive_; }
  int gaps() const { return gaps_; }
  int windows() const { return windows_; }
  int heartbeats() const { return heartbeats_; }
  std::size_t num_events() const { return ages_.size(); }
  Duration Age(double quantile) {
    std::sort(ages_.begin(), ages_.end());
    return ages_[static_cast<std::size_t>(quantile * static_cast<double>(ages_.size() - 1))];
  }

 private:
  struct Bell {
    std::mutex mutex;
    std::condition_variable changed;
    bool rung = false;
  };
  std::shared_ptr<Bell> bell_;
  EventWatch watch_;
  std::int64_t next_ = 1;
  bool consecutive_ = true;
  int gaps_ = 0;
  int windows_ = 0;
  std::atomic<int> heartbeats_ = 0;
  std::vector<Duration> ages_;
};

std::shared_ptr<EventLog> MakeLog(WatchDispatcher& dispatcher, const EventLogLimits& limits = {}) {
  auto log = std::make_shared<EventLog>(limits, SystemClock(), &dispatcher, 0);
  log->Reserve(1'000'000'000);
  return log;
}

TEST(WatchDispatcherTest, NoWatcherSleepsThroughAnEvent) {
  WatchDispatcher dispatcher(SystemClock());
  for (int round = 0; round < 20; ++round) {
    const auto log = MakeLog(dispatcher, {.max_events = 100'000, .max_bytes = 100 << 20});
    std::vector<std::unique_ptr<Reader>> readers;
    for (int i = 0; i < 4; ++i) {
      readers.push_back(std::make_unique<Reader>(
          log, EventWatchOptions{.min_interval = i < 2 ? Duration(0) : Duration(200us), .max_backlog = 50}));
    }
    std::vector<std::thread> threads;
    for (const auto& reader : readers) threads.emplace_back([&reader] { reader->ReadToEnd(); });
    std::atomic<std::int64_t> to_commit = 0;
    std::thread writer([&log, &to_commit] {
      while (!log->closed() || to_commit.load() != log->last_sequence()) {
        log->MarkStored(to_commit.load());
        std::this_thread::yield();
      }
      log->MarkStored(to_commit.load());
    });
    for (int k = 0; k < 2000; ++k) {
      log->Append(EventKind::kIterate, "i");
      if (k % 100 == 99) to_commit = log->Append(EventKind::kWindowAccepted, "w").sequence;
    }
    to_commit = log->Append(EventKind::kSummary, "done").sequence;
    writer.join();
    for (std::thread& thread : threads) thread.join();
    for (const auto& reader : readers) {
      EXPECT_TRUE(reader->consecutive());
      EXPECT_EQ(reader->windows(), 20);
    }
  }
}

TEST(WatchDispatcherTest, RingsForHeartbeatsWhileNothingHappens) {
  WatchDispatcher dispatcher(SystemClock());
  const auto log = MakeLog(dispatcher);
  Reader reader(log, {.heartbeat = 20ms});
  const auto begin = std::chrono::steady_clock::now();
  std::thread thread([&reader] { reader.ReadToEnd(); });
  while (reader.heartbeats() < 5 && std::chrono::steady_clock::now() - begin < 10s) std::this_thread::sleep_for(1ms);
  log->MarkStored(log->Append(EventKind::kSummary, "done").sequence);
  thread.join();
  EXPECT_GE(reader.heartbeats(), 5);
  EXPECT_LE(reader.heartbeats(), (std::chrono::steady_clock::now() - begin) / 20ms);
}

TEST(WatchDispatcherTest, RingsOnceForEventsThatFollowAtOnce) {
  WatchDispatcher dispatcher(SystemClock());
  const auto log = MakeLog(dispatcher);
  std::atomic<int> rings = 0;
  EventWatch watch(log, {}, [&rings] { ++rings; });
  const auto begin = std::chrono::steady_clock::now();
  int events = 0, last_rings = -1;
  while (std::chrono::steady_clock::now() - begin < 100ms) {
    log->Append(EventKind::kIterate, "i");
    ++events;
    if (rings == last_rings) continue;
    last_rings = rings;
    while (watch.Next().got == Got::kEvent) {
    }
  }
  const auto rounds = (std::chrono::steady_clock::now() - begin) / WatchDispatcher::kPace;
  EXPECT_GT(events, 2 * rounds);
  EXPECT_GE(rings, 2);
  EXPECT_LE(rings, rounds + 1);
}

TEST(WatchDispatcherTest, WatchersMayComeAndGoWhileTheEngineRuns) {
  WatchDispatcher dispatcher(SystemClock());
  const auto log = MakeLog(dispatcher);
  std::atomic<bool> done = false;
  std::vector<std::thread> visitors;
  for (int i = 0; i < 3; ++i) {
    visitors.emplace_back([&log, &done] {
      std::int64_t after = 0;
      while (!done) {
        EventWatch watch(log, {.after = after}, [] {});
        for (int k = 0; k < 5; ++k) {
          const EventWatch::Delivery delivery = watch.Next();
          if (delivery.got != Got::kEvent) continue;
          EXPECT_EQ(delivery.gap.has_value() ? delivery.gap->first : delivery.event.sequence, after + 1);
          after = watch.position();
        }
      }
    });
  }
  for (int k = 0; k < 20'000; ++k) log->Append(EventKind::kIterate, "i");
  done = true;
  for (std::thread& visitor : visitors) visitor.join();
}

// The cost of an iterate for the engine with a hundred watchers, ten of which never read. The time is printed. The
// asserted bound is far above the time on a quiet machine, and far below the delay of one watcher.
TEST(WatchDispatcherTest, TheEngineDoesNotWaitForAHundredWatchers) {
  WatchDispatcher dispatcher(SystemClock());
  const auto log = MakeLog(dispatcher);
  std::vector<std::unique_ptr<EventWatch>> stalled;
  for (int i = 0; i < 10; ++i) stalled.push_back(std::make_unique<EventWatch>(log, EventWatchOptions{}, [] {}));
  std::vector<std::unique_ptr<Reader>> readers;
  for (int i = 0; i < 90; ++i)
    readers.push_back(std::make_unique<Reader>(log, EventWatchOptions{.min_interval = 50ms}));
  Reader unthrottled(log, {});
  std::vector<std::thread> threads;
  for (const auto& reader : readers) threads.emplace_back([&reader] { reader->ReadToEnd(); });
  threads.emplace_back([&unthrottled] { unthrottled.ReadToEnd(); });

  std::vector<double> microseconds;
  const auto begin = std::chrono::steady_clock::now();
  for (int k = 0; k < 1500; ++k) {
    std::this_thread::sleep_until(begin + k * 1ms);
    const auto before = std::chrono::steady_clock::now();
    log->Append(EventKind::kIterate, std::string(200, 'i'));
    microseconds.push_back(
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - before).count());
  }
  log->MarkStored(log->Append(EventKind::kSummary, "done").sequence);
  for (std::thread& thread : threads) thread.join();
  const auto most = static_cast<std::size_t>((std::chrono::steady_clock::now() - begin) / 50ms) + 3;

  double sum = 0;
  for (const double time : microseconds) sum += time;
  std::sort(microseconds.begin(), microseconds.end());
  RecordProperty("append_median_us", std::to_string(microseconds[microseconds.size() / 2]));
  RecordProperty("append_p99_us", std::to_string(microseconds[microseconds.size() * 99 / 100]));
  RecordProperty("append_share_percent", std::to_string(sum / 1500 / 1000 * 100));
  RecordProperty("unthrottled_p99_age_us", std::to_string(unthrottled.Age(0.99).count()));
  RecordProperty("throttled_p99_age_us", std::to_string(readers[0]->Age(0.99).count()));
  RecordProperty("throttled_events", std::to_string(readers[0]->num_events()));
  RecordProperty("log_bytes", std::to_string(log->num_bytes()));
  EXPECT_LT(microseconds[microseconds.size() / 2], 100);
  for (const auto& reader : readers) {
    EXPECT_TRUE(reader->consecutive());
    EXPECT_LE(reader->num_events(), most);
    EXPECT_GE(reader->num_events(), 2u);
  }
  EXPECT_TRUE(unthrottled.consecutive());
}

}  // namespace
}  // namespace dlcs::jobs
