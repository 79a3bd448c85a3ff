// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/call_registry.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <thread>

namespace dlcs {
namespace {

using std::chrono::milliseconds;

TEST(CallRegistryTest, StopsWhatIsUnderWayAndRemembersWhy) {
  CallRegistry calls;
  const std::shared_ptr<SolveControl> first = calls.Register(CallKind::kCompute);
  const std::shared_ptr<SolveControl> second = calls.Register(CallKind::kCompute);
  second->Stop(StopCause::kDeadline);
  EXPECT_FALSE(first->token().stop_requested());
  calls.StopAll(StopCause::kShutdown);
  EXPECT_TRUE(first->token().stop_requested());
  EXPECT_EQ(first->cause(), StopCause::kShutdown);
  EXPECT_EQ(second->cause(), StopCause::kDeadline) << "the first cause stays";
}

TEST(CallRegistryTest, StopsTheCallOfAnIdForItsUserOrForAll) {
  CallRegistry calls;
  const std::shared_ptr<SolveControl> nameless = calls.Register(CallKind::kCompute);
  std::shared_ptr<SolveControl> of_alice = calls.Register(CallKind::kCompute, {.id = "solve-1", .user = "alice"});
  const std::shared_ptr<SolveControl> of_bob = calls.Register(CallKind::kCompute, {.id = "solve-2", .user = "bob"});
  EXPECT_FALSE(calls.Stop("", "", StopCause::kCancelled));
  EXPECT_FALSE(calls.Stop("solve-1", "bob", StopCause::kCancelled));
  EXPECT_FALSE(of_alice->token().stop_requested());
  EXPECT_TRUE(calls.Stop("solve-1", "alice", StopCause::kCancelled));
  EXPECT_EQ(of_alice->cause(), StopCause::kCancelled);
  EXPECT_FALSE(of_bob->token().stop_requested());
  EXPECT_TRUE(calls.Stop("solve-2", std::nullopt, StopCause::kCancelled));
  EXPECT_TRUE(of_bob->token().stop_requested());
  EXPECT_FALSE(nameless->token().stop_requested());
  of_alice.reset();
  EXPECT_FALSE(calls.Stop("solve-1", "alice", StopCause::kCancelled)) << "it has ended";
}

TEST(CallRegistryTest, RefusesNewCallsWhileDraining) {
  CallRegistry calls;
  EXPECT_NE(calls.Register(CallKind::kCompute), nullptr);
  calls.Drain();
  EXPECT_EQ(calls.Register(CallKind::kCompute), nullptr);
}

TEST(CallRegistryTest, StopsCallsAboutTheStoreWhenItDrainsAndLetsTheOthersCompute) {
  CallRegistry calls;
  std::shared_ptr<SolveControl> solve = calls.Register(CallKind::kCompute);
  std::shared_ptr<SolveControl> watch = calls.Register(CallKind::kStore);
  calls.Drain();
  EXPECT_EQ(watch->cause(), StopCause::kShutdown);
  EXPECT_FALSE(solve->token().stop_requested());
  EXPECT_FALSE(calls.WaitUntilComputed(milliseconds(0)));
  solve.reset();
  EXPECT_TRUE(calls.WaitUntilComputed(milliseconds(0))) << "a watcher is no solve";
  EXPECT_FALSE(calls.WaitUntilIdle(milliseconds(0)));
  watch.reset();
  EXPECT_TRUE(calls.WaitUntilIdle(milliseconds(0)));
}

TEST(CallRegistryTest, WaitsUntilTheLastCallIsGone) {
  CallRegistry calls;
  EXPECT_TRUE(calls.WaitUntilIdle(milliseconds(0)));
  std::shared_ptr<SolveControl> call = calls.Register(CallKind::kCompute);
  EXPECT_FALSE(calls.WaitUntilIdle(milliseconds(10)));
  std::thread ending([&call] {
    std::this_thread::sleep_for(milliseconds(20));
    call.reset();
  });
  EXPECT_TRUE(calls.WaitUntilIdle(milliseconds(10'000)));
  ending.join();
}

}  // namespace
}  // namespace dlcs
