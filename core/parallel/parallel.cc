// SPDX-License-Identifier: Apache-2.0

#include "core/parallel/parallel.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "core/parallel/stop_scope.h"

namespace dlcs {

struct Workers::Arena {
  explicit Arena(int max_threads) : arena(Concurrency(max_threads)) {}
  // oneTBB prints a warning if more threads are requested than the machine has.
  static int Concurrency(int max_threads) {
    const int available = oneapi::tbb::info::default_concurrency();
    return max_threads > 0 ? std::min(max_threads, available) : available;
  }
  oneapi::tbb::task_arena arena;
};

Workers::Workers(int max_threads) : arena_(std::make_unique<Arena>(max_threads)) {}
Workers::~Workers() = default;

int Workers::max_threads() const { return arena_->arena.max_concurrency(); }

void Workers::ForBlocks(Index count, Index block_size, const std::function<void(Index, Index, Index)>& body) {
  const Index blocks = (count + block_size - 1) / block_size;
  const auto run = [&](Index block) {
    LookForStop();
    body(block, block * block_size, std::min(count, (block + 1) * block_size));
  };
  if (blocks <= 1 || max_threads() == 1) {
    for (Index block = 0; block < blocks; ++block) run(block);
    return;
  }
  const std::stop_token* const stop = StopScope::Current();
  arena_->arena.execute([&] {
    oneapi::tbb::parallel_for(
        oneapi::tbb::blocked_range<Index>(0, blocks, 1),
        [&](const oneapi::tbb::blocked_range<Index>& range) {
          const StopScope scope(stop);
          for (Index block = range.begin(); block != range.end(); ++block) run(block);
        },
        oneapi::tbb::simple_partitioner());
  });
}

void ForEachOnOwnThreads(Index count, int num_threads, const std::function<void(Index)>& body) {
  if (num_threads <= 0) num_threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::atomic<Index> next = 0;
  std::mutex mutex;
  std::exception_ptr thrown;
  const auto work = [&] {
    try {
      for (Index k = next++; k < count; k = next++) body(k);
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!thrown) thrown = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> others;
    for (Index k = 1; k < std::min<Index>(num_threads, count); ++k) others.emplace_back(work);
    work();
  }
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace dlcs
