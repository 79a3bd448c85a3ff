// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/ensemble_buffer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stop_token>
#include <thread>
#include <vector>

namespace dlcs {
namespace {

using ::testing::ElementsAre;
using Got = EnsembleBuffer::Got;
using namespace std::chrono_literals;

// `count` members of 1000 bytes, room for `room` of them.
PreparedEnsemble Members(int count, int room) {
  PreparedEnsemble prepared;
  prepared.labels.assign(static_cast<std::size_t>(count), "named");
  prepared.result_bytes.assign(static_cast<std::size_t>(count), 1000);
  prepared.all_bytes = 1000 * count;
  prepared.held_bytes = 1000 * room;
  return prepared;
}

FinishedSolve Finished(Index times) {
  Solution solution;
  solution.termination = Termination::kReachedEnd;
  for (Index k = 0; k < times; ++k) solution.times.push_back(static_cast<double>(k));
  solution.x = Matrix::Random(3, times);
  solution.y = Matrix::Random(2, times);
  solution.w = Matrix::Random(2, times);
  return FinishedSolve(std::move(solution), std::nullopt, StopCause::kNone, 1);
}

std::vector<v1::EnsembleEvent> TakeAll(EnsembleBuffer& buffer) {
  std::vector<v1::EnsembleEvent> events;
  for (v1::EnsembleEvent event; buffer.Next(event) == Got::kEvent;) events.push_back(event);
  return events;
}

TEST(EnsembleBufferTest, GivesEachMemberWholeAndInTheOrderInWhichTheyFinish) {
  EnsembleBuffer buffer;
  v1::EnsembleEvent event;
  EXPECT_EQ(buffer.Next(event), Got::kNothing);
  buffer.Open("id", Members(2, 2));
  ASSERT_TRUE(buffer.MayBegin(0, {}));
  ASSERT_TRUE(buffer.MayBegin(1, {}));
  buffer.Finished(1, Finished(50'000));  // of more than one chunk
  buffer.Finished(0, Finished(2));
  v1::EnsembleSummary summary;
  summary.set_solved(2);
  buffer.Close(summary);
  EXPECT_TRUE(buffer.has_more());
  EXPECT_FALSE(buffer.delivered());

  const std::vector<v1::EnsembleEvent> events = TakeAll(buffer);
  std::vector<std::int64_t> members;
  std::int64_t times = 0;
  for (std::size_t k = 0; k < events.size(); ++k) {
    EXPECT_EQ(events[k].sequence(), static_cast<std::int64_t>(k) + 1);
    if (events[k].has_trajectory()) {
      EXPECT_EQ(events[k].trajectory().chunk().first(), times % 50'000);
      times += events[k].trajectory().chunk().times_size();
    }
    if (events[k].has_member()) members.push_back(events[k].member().member());
  }
  EXPECT_EQ(events.front().accepted().members(), 2);
  EXPECT_EQ(events.back().summary().solved(), 2);
  EXPECT_EQ(times, 50'002);
  EXPECT_THAT(members, ElementsAre(1, 0));
  EXPECT_EQ(events[events.size() - 2].member().label(), "named");
  EXPECT_TRUE(buffer.delivered());
  EXPECT_EQ(buffer.Next(event), Got::kEnd);
  EXPECT_EQ(buffer.held_bytes(), 0);
}

TEST(EnsembleBufferTest, MembersWaitForRoomUntilTheReaderHasTakenOne) {
  EnsembleBuffer buffer;
  buffer.Open("id", Members(3, 2));
  ASSERT_TRUE(buffer.MayBegin(0, {}));
  ASSERT_TRUE(buffer.MayBegin(1, {}));
  std::atomic<bool> begun = false;
  std::jthread third([&] { begun = buffer.MayBegin(2, {}); });
  buffer.Finished(0, Finished(10));
  v1::EnsembleEvent event;
  for (int k = 0; k < 2; ++k) ASSERT_EQ(buffer.Next(event), Got::kEvent);
  ASSERT_TRUE(event.has_trajectory());
  std::this_thread::sleep_for(20ms);
  EXPECT_FALSE(begun);  // the summary of the first is still to be taken
  EXPECT_EQ(buffer.held_bytes(), 2000);
  ASSERT_EQ(buffer.Next(event), Got::kEvent);
  ASSERT_TRUE(event.has_member());
  third.join();
  EXPECT_TRUE(begun);
  EXPECT_EQ(buffer.held_bytes(), 2000);
}

TEST(EnsembleBufferTest, AStopEndsTheWaitForRoom) {
  EnsembleBuffer buffer;
  buffer.Open("id", Members(2, 1));
  std::stop_source stop;
  ASSERT_TRUE(buffer.MayBegin(0, stop.get_token()));
  std::atomic<bool> begun = true;
  std::jthread second([&] { begun = buffer.MayBegin(1, stop.get_token()); });
  std::this_thread::sleep_for(10ms);
  stop.request_stop();
  second.join();
  EXPECT_FALSE(begun);
  EXPECT_EQ(buffer.held_bytes(), 1000);
}

TEST(EnsembleBufferTest, AnErrorComesAfterTheMembersThatFinished) {
  EnsembleBuffer buffer;
  buffer.Open("id", Members(1, 1));
  ASSERT_TRUE(buffer.MayBegin(0, {}));
  buffer.Finished(0, Finished(1));
  buffer.Close(absl::InternalError("broken"));
  EXPECT_EQ(TakeAll(buffer).size(), 3U);
  v1::EnsembleEvent event;
  EXPECT_EQ(buffer.Next(event), Got::kEnd);
  EXPECT_EQ(buffer.status().message(), "broken");
}

}  // namespace
}  // namespace dlcs
