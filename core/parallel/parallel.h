// SPDX-License-Identifier: Apache-2.0
// A small interface to oneTBB, which nothing else in the project includes.

#ifndef DLCS_CORE_PARALLEL_PARALLEL_H_
#define DLCS_CORE_PARALLEL_PARALLEL_H_

#include <functional>
#include <memory>

#include "core/types.h"

namespace dlcs {

// A share of the machine: at most `max_threads` threads (0: all), the calling one included.
class Workers {
 public:
  explicit Workers(int max_threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  // Calls body(block, begin, end) once for each block of at most `block_size` consecutive indices of [0, count), in any
  // order and on any thread, and returns when all are done. Blocks depend on the arguments alone, never on the number
  // of threads: work that keeps state per block, or sums per block and then over blocks in order, has the same bits on
  // any machine. One block runs on the calling thread. The StopScope of the caller applies to all bodies, and is
  // checked before each. Bodies throw nothing but Stopped, which is rethrown here after all started bodies have
  // returned.
  void ForBlocks(Index count, Index block_size, const std::function<void(Index block, Index begin, Index end)>& body);

  int max_threads() const;

 private:
  struct Arena;
  std::unique_ptr<Arena> arena_;
};

// Calls body(k) once for each k of [0, count), begun in this order, on `num_threads` threads (0: one for each
// processor), the calling one included, and returns when all are done. The threads are created for this call. Unlike
// the threads of Workers, which all solves of a process share, they may block without delaying other work. An exception
// of a body is rethrown here, and no further bodies are started.
void ForEachOnOwnThreads(Index count, int num_threads, const std::function<void(Index)>& body);

}  // namespace dlcs

#endif  // DLCS_CORE_PARALLEL_PARALLEL_H_
