// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/worker_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>

namespace dlcs {
namespace {

TEST(WorkerPoolTest, RunsTasksAtTheSameTime) {
  std::latch both(2);
  WorkerPool pool(2);
  // Each waits for the other: with one thread this would never end.
  for (int i = 0; i < 2; ++i) pool.Run([&both] { both.arrive_and_wait(); });
  both.wait();
}

TEST(WorkerPoolTest, FinishesWhatIsQueuedBeforeItEnds) {
  std::atomic<int> done = 0;
  {
    WorkerPool pool(2);
    for (int i = 0; i < 1000; ++i) pool.Run([&done] { ++done; });
  }
  EXPECT_EQ(done, 1000);
}

}  // namespace
}  // namespace dlcs
