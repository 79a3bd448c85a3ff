// SPDX-License-Identifier: Apache-2.0

#include "core/parallel/stop_scope.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/analyze.h"
#include "core/lcp/lcp.h"
#include "core/parallel/parallel.h"
#include "core/setup_cache.h"
#include "core/solve.h"
#include "tests/support/problems.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

TEST(StopScopeTest, ScopesNest) {
  std::stop_source stop;
  stop.request_stop();
  LookForStop();
  {
    const StopScope outer(stop.get_token());
    EXPECT_THROW(LookForStop(), Stopped);
    {
      const StopScope inner(nullptr);
      EXPECT_NO_THROW(LookForStop());
    }
    EXPECT_THROW(LookForStop(), Stopped);
  }
  EXPECT_NO_THROW(LookForStop());
}

TEST(StopScopeTest, WorkersCarryItAndWhatIsThrown) {
  std::stop_source stop;
  Workers workers(4);
  const StopScope scope(stop.get_token());
  std::atomic<int> bodies = 0, seen = 0;
  EXPECT_THROW(workers.ForBlocks(64, 1,
                                 [&](Index, Index, Index) {
                                   ++bodies;
                                   if (bodies == 8) stop.request_stop();
                                   if (StopScope::Current() != nullptr) ++seen;
                                   LookForStop();
                                 }),
               Stopped);
  EXPECT_EQ(seen, bodies);
  EXPECT_GE(bodies, 8);
}

// Stops the solve when it has told of so many windows.
class Stopper final : public Observer {
 public:
  explicit Stopper(int windows) : left_(windows) {}
  void OnWindowFinished(const WindowOutcome& outcome) override {
    reached = outcome.end;
    if (--left_ == 0) stop.request_stop();
  }
  std::stop_source stop;
  double reached = 0;

 private:
  int left_;
};

TEST(StopScopeTest, WhatWasFoundBeforeAStopIsKept) {
  Options options;
  options.method = Method::kLaplaceIteration;
  options.num_steps = 4000;
  options.window_steps = 10;
  Stopper stopper(20);
  const auto solution = Solve(testing::FourVariableEasy(), options, stopper, stopper.stop.get_token());
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_EQ(solution->termination, Termination::kCancelled);
  EXPECT_GE(solution->times.size(), 200u);
  EXPECT_EQ(static_cast<Index>(solution->times.size()), solution->x.cols());
  EXPECT_NEAR(solution->times.back(), stopper.reached, 20 * solution->step);
}

TEST(StopScopeTest, StoppedFromTheBeginningIsCancelledAndEmpty) {
  std::stop_source stop;
  stop.request_stop();
  Observer nobody;
  for (const Method method : {Method::kAuto, Method::kLaplaceIteration, Method::kPaperIteration, Method::kExponentialMarch,
                              Method::kTimeStepping, Method::kEventLocated}) {
    Options options;
    options.method = method;
    const auto solution = Solve(testing::FourVariableEasy(), options, nobody, stop.get_token());
    ASSERT_TRUE(solution.ok()) << solution.status();
    EXPECT_EQ(solution->termination, Termination::kCancelled);
    EXPECT_EQ(static_cast<Index>(solution->times.size()), solution->x.cols());
    EXPECT_LE(solution->times.size(), 1u);
  }
  const Matrix M = testing::RandomMatrix(40, 40, 1);
  const Matrix skew = M - M.transpose();
  EXPECT_TRUE(absl::IsCancelled(SolveLcp(skew, -Vector::Ones(40), LcpRequest{}, stop.get_token()).status()));
  const auto analysis = Analyze(testing::FourVariableEasy(), {}, stop.get_token());
  ASSERT_TRUE(analysis.ok()) << analysis.status();
  EXPECT_FALSE(analysis->warnings.empty());
}

// Waits until `flag` is set.
void WaitFor(const std::atomic<bool>& flag) {
  while (!flag) std::this_thread::yield();
}

TEST(StopScopeTest, OneWhoIsStoppedLeavesItsSetupToThoseWhoWait) {
  SetupCache cache(1e6);
  const SetupKey key("number");
  std::stop_source stop;
  std::atomic<bool> is_making = false;
  std::thread stopped([&] {
    const StopScope scope(stop.get_token());
    EXPECT_THROW(cache.Get<int>(key,
                                [&]() -> SetupCache::Made<int> {
                                  is_making = true;
                                  for (;;) LookForStop();
                                }),
                 Stopped);
  });
  WaitFor(is_making);
  std::thread waiting([&] {
    const auto value = cache.Get<int>(key, [] { return SetupCache::Made<int>{std::make_shared<const int>(7), 4}; });
    EXPECT_EQ(*value, 7);
  });
  stop.request_stop();
  stopped.join();
  waiting.join();
}

TEST(StopScopeTest, OneWhoWaitsForAnothersSetupIsStopped) {
  SetupCache cache(1e6);
  const SetupKey key("number");
  std::atomic<bool> is_making = false, may_end = false;
  std::thread maker([&] {
    cache.Get<int>(key, [&] {
      is_making = true;
      WaitFor(may_end);
      return SetupCache::Made<int>{std::make_shared<const int>(7), 4};
    });
  });
  WaitFor(is_making);
  std::stop_source stop;
  stop.request_stop();
  {
    const StopScope scope(stop.get_token());
    EXPECT_THROW(cache.Get<int>(key, [] { return SetupCache::Made<int>{}; }), Stopped);
  }
  may_end = true;
  maker.join();
}

}  // namespace
}  // namespace dlcs
