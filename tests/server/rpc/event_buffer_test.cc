// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/event_buffer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "server/wire/convert.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using ::testing::IsEmpty;
using Got = EventBuffer::Got;

// Puts numbered events as a session would.
class Producer {
 public:
  explicit Producer(EventBuffer& buffer) : buffer_(buffer) {}

  void Begin() {
    Put([](v1::SolveEvent& event) { event.mutable_accepted(); });
    Put([](v1::SolveEvent& event) { event.mutable_analysis(); });
  }
  void Window(int iterates) {
    Put([](v1::SolveEvent& event) { event.mutable_window_started(); });
    for (int k = 1; k <= iterates; ++k) {
      Put([k](v1::SolveEvent& event) { event.mutable_iterate()->set_iteration(k); });
    }
    Put([](v1::SolveEvent& event) { event.mutable_window_finished()->set_reason(std::string(60, 'w')); });
  }
  void End(Index num_times) {
    Solution solution;
    solution.termination = Termination::kReachedEnd;
    for (Index k = 0; k < num_times; ++k) solution.times.push_back(static_cast<double>(k));
    solution.x = Matrix::Random(3, num_times);
    solution.y = Matrix::Random(2, num_times);
    solution.w = Matrix::Random(2, num_times);
    buffer_.Close(FinishedSolve(std::move(solution), std::nullopt, StopCause::kNone, next_sequence_, sent_));
  }
  void Chunk() {
    Put([this](v1::SolveEvent& event) {
      event.mutable_trajectory()->set_first(sent_);
      event.mutable_trajectory()->add_times(static_cast<double>(sent_++));
    });
  }
  std::int64_t put() const { return next_sequence_ - 1; }

 private:
  template <typename Fill>
  void Put(Fill fill) {
    v1::SolveEvent event;
    event.set_sequence(next_sequence_++);
    fill(event);
    buffer_.Put(std::move(event));
  }

  EventBuffer& buffer_;
  std::int64_t next_sequence_ = 1;
  Index sent_ = 0;  // times, in chunks
};

std::vector<v1::SolveEvent> ReadToEnd(EventBuffer& buffer) {
  std::vector<v1::SolveEvent> events;
  for (v1::SolveEvent event; buffer.Next(event) == Got::kEvent;) events.push_back(event);
  return events;
}

TEST(EventBufferTest, DeliversEverythingInOrderWhileThereIsRoom) {
  EventBuffer buffer;
  Producer producer(buffer);
  producer.Begin();
  for (int window = 0; window < 10; ++window) producer.Window(20);
  producer.End(100);
  const std::vector<v1::SolveEvent> events = ReadToEnd(buffer);
  EXPECT_EQ(testing::WhatIsWrongWithOrder(events), "");
  EXPECT_EQ(testing::Count(events, v1::SolveEvent::kIterate), 200);
  EXPECT_EQ(testing::Count(events, v1::SolveEvent::kGap), 0);
  EXPECT_EQ(events.back().summary().conflated_iterates(), 0);
}

TEST(EventBufferTest, HasNothingUntilSomethingComes) {
  EventBuffer buffer;
  v1::SolveEvent event;
  EXPECT_EQ(buffer.Next(event), Got::kNothing);
  Producer(buffer).Begin();
  EXPECT_EQ(buffer.Next(event), Got::kEvent);
  EXPECT_TRUE(event.has_accepted());
}

TEST(EventBufferTest, KeepsTheLatestIteratesAndAnnouncesTheOthers) {
  EventBuffer buffer({.max_events = 1000, .max_iterates = 5});
  Producer producer(buffer);
  producer.Begin();
  producer.Window(100);
  producer.End(1);
  const std::vector<v1::SolveEvent> events = ReadToEnd(buffer);
  EXPECT_EQ(testing::WhatIsWrongWithOrder(events), "");
  ASSERT_EQ(testing::Count(events, v1::SolveEvent::kGap), 1);
  EXPECT_EQ(events[3].gap().iterates(), 95);
  std::vector<std::int64_t> iterations;
  for (const v1::SolveEvent& event : events) {
    if (event.has_iterate()) iterations.push_back(event.iterate().iteration());
  }
  EXPECT_THAT(iterations, ::testing::ElementsAre(96, 97, 98, 99, 100));
  EXPECT_EQ(events.back().summary().conflated_iterates(), 95);
}

TEST(EventBufferTest, WindowsOutliveIterates) {
  EventBuffer buffer({.max_events = 1000, .max_iterates = 10});
  Producer producer(buffer);
  producer.Begin();
  for (int window = 0; window < 50; ++window) producer.Window(20);
  producer.End(1);
  const std::vector<v1::SolveEvent> events = ReadToEnd(buffer);
  EXPECT_EQ(testing::WhatIsWrongWithOrder(events), "");
  EXPECT_EQ(testing::Count(events, v1::SolveEvent::kWindowStarted), 50);
  EXPECT_EQ(testing::Count(events, v1::SolveEvent::kWindowFinished), 50);
  EXPECT_EQ(testing::Count(events, v1::SolveEvent::kIterate), 10);
}

TEST(EventBufferTest, StaysWithinItsBoundWhenNobodyReads) {
  EventBuffer buffer({.max_events = 64, .max_iterates = 32});
  Producer producer(buffer);
  producer.Begin();
  std::size_t most = 0;
  for (int window = 0; window < 20'000; ++window) {
    producer.Window(window % 7);
    most = std::max(most, buffer.size());
  }
  EXPECT_LE(most, 64u);
  producer.End(1);
  const std::vector<v1::SolveEvent> events = ReadToEnd(buffer);
  EXPECT_EQ(testing::WhatIsWrongWithOrder(events), "");
  EXPECT_TRUE(events[1].has_analysis());
  // The latest ones are kept.
  EXPECT_EQ(events[events.size() - 3].sequence(), producer.put());
}

TEST(EventBufferTest, TakesTwoChunksAndDropsNone) {
  EventBuffer buffer({.max_events = 8, .max_iterates = 2});
  Producer producer(buffer);
  producer.Begin();
  producer.Window(1);
  EXPECT_TRUE(buffer.WantsChunk());
  producer.Chunk();
  producer.Window(1);
  EXPECT_TRUE(buffer.WantsChunk());
  producer.Chunk();
  for (int window = 0; window < 100; ++window) producer.Window(3);
  EXPECT_FALSE(buffer.WantsChunk());
  EXPECT_LE(buffer.size(), 8u);
  std::vector<v1::SolveEvent> events;
  while (!buffer.WantsChunk()) ASSERT_EQ(buffer.Next(events.emplace_back()), Got::kEvent);
  EXPECT_TRUE(events.back().has_trajectory());
  producer.Chunk();
  EXPECT_FALSE(buffer.WantsChunk());
  producer.End(5);
  for (const v1::SolveEvent& event : ReadToEnd(buffer)) events.push_back(event);
  EXPECT_EQ(testing::WhatIsWrongWithOrder(events), "");
}

TEST(EventBufferTest, DefaultBoundIsThreeMegabytes) {
  EventBuffer buffer;
  Producer producer(buffer);
  producer.Begin();
  for (int window = 0; window < 20'000; ++window) producer.Window(1);
  producer.End(0);
  std::size_t bytes = 0;
  // A list node is two pointers beside the event.
  for (const v1::SolveEvent& event : ReadToEnd(buffer)) bytes += event.SpaceUsedLong() + 2 * sizeof(void*);
  EXPECT_GT(bytes, 500'000u);
  EXPECT_LT(bytes, 3'000'000u);
}

TEST(EventBufferTest, ErrorsComeAfterTheEventsBeforeThem) {
  EventBuffer buffer;
  Producer(buffer).Begin();
  buffer.Close(absl::InternalError("out of memory"));
  EXPECT_EQ(ReadToEnd(buffer).size(), 2u);
  v1::SolveEvent event;
  EXPECT_EQ(buffer.Next(event), Got::kEnd);
  EXPECT_EQ(buffer.status(), absl::InternalError("out of memory"));
}

TEST(EventBufferTest, KnowsWhatIsLeft) {
  EventBuffer buffer;
  v1::SolveEvent event;
  EXPECT_FALSE(buffer.has_more());
  Producer producer(buffer);
  producer.Begin();  // two events
  EXPECT_TRUE(buffer.has_more());
  ASSERT_EQ(buffer.Next(event), Got::kEvent);
  ASSERT_EQ(buffer.Next(event), Got::kEvent);
  EXPECT_FALSE(buffer.has_more());
  producer.End(1);
  ASSERT_EQ(buffer.Next(event), Got::kEvent);
  ASSERT_TRUE(event.has_trajectory());
  EXPECT_TRUE(buffer.has_more());
  EXPECT_FALSE(buffer.delivered());
  ASSERT_EQ(buffer.Next(event), Got::kEvent);
  ASSERT_TRUE(event.has_summary());
  EXPECT_FALSE(buffer.has_more());
  EXPECT_TRUE(buffer.delivered());

  EventBuffer refused;
  refused.Close(absl::InternalError("out of memory"));
  EXPECT_FALSE(refused.has_more());
  EXPECT_FALSE(refused.delivered());
}

TEST(EventBufferTest, ChunksAreMadeOnDemandAndStayBelowAMegabyte) {
  EventBuffer buffer;
  Producer producer(buffer);
  producer.Begin();
  producer.End(200'000);  // 9.6 MB
  EXPECT_EQ(buffer.size(), 2u);
  const std::vector<v1::SolveEvent> events = ReadToEnd(buffer);
  EXPECT_EQ(testing::WhatIsWrongWithOrder(events), "");
  EXPECT_GE(testing::Count(events, v1::SolveEvent::kTrajectory), 10);
  for (const v1::SolveEvent& event : events) EXPECT_LT(event.ByteSizeLong(), 1'000'000u);
}

// A fast producer and readers of several speeds in threads of their own; for the thread sanitizer as much as
// for the numbers.
TEST(EventBufferTest, AccountsForEveryNumberAtAnyReadingSpeed) {
  for (const int microseconds_per_event : {0, 1, 20}) {
    EventBuffer buffer({.max_events = 100, .max_iterates = 50});
    std::thread engine([&buffer] {
      Producer producer(buffer);
      producer.Begin();
      for (int window = 0; window < 2'000; ++window) producer.Window(10);
      producer.End(10);
    });
    std::vector<v1::SolveEvent> events;
    v1::SolveEvent event;
    for (Got got = Got::kNothing; got != Got::kEnd;) {
      got = buffer.Next(event);
      if (got == Got::kEvent) events.push_back(event);
      if (microseconds_per_event > 0) {
        std::this_thread::sleep_for(std::chrono::microseconds(microseconds_per_event));
      }
    }
    engine.join();
    EXPECT_EQ(testing::WhatIsWrongWithOrder(events), "") << microseconds_per_event;
    std::int64_t conflated = 0;
    for (const v1::SolveEvent& gap : events) conflated += gap.gap().iterates();
    EXPECT_EQ(events.back().summary().conflated_iterates(), conflated);
    EXPECT_EQ(conflated + testing::Count(events, v1::SolveEvent::kIterate), 20'000);
  }
}

}  // namespace
}  // namespace dlcs
