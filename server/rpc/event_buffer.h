// SPDX-License-Identifier: Apache-2.0
// The buffer between one solve and its reader. The engine never waits, memory is bounded, and gaps report which events
// were dropped.

#ifndef DLCS_SERVER_RPC_EVENT_BUFFER_H_
#define DLCS_SERVER_RPC_EVENT_BUFFER_H_

#include <cstddef>
#include <cstdint>
#include <list>
#include <mutex>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"
#include "server/session/solve_session.h"

namespace dlcs {

// Two kinds of memory:
//
// - Events of the running engine are queued, at most `max_events`, and `max_chunks` chunks of the trajectory among
//   them. When a reader is so slow that iterates fill their share of the queue, the oldest iterate is dropped for each
//   new one. When windows alone fill it (a reader that stopped while thousands of windows went by), the oldest window
//   event is dropped too. Each run of dropped neighbors is replaced by one gap. An event takes about 0.3 KB here and a
//   chunk 1/4 MB, so the default is 3.5 MB at most.
// - The rest of the trajectory is not queued. The buffer keeps the finished solve and makes one chunk when the reader
//   requests it.
//
// `accepted`, `analysis`, the chunks and the summary are never dropped. The numbers of the events delivered
// are 1, 2, 3, ... except where a gap covers the numbers in between.
//
// Put() and Close() come from the thread of the engine, Next() from any thread, one call at a time.
class EventBuffer {
 public:
  struct Limits {
    std::size_t max_events = 8192;
    std::size_t max_iterates = 4096;  // of max_events
    std::size_t max_chunks = 2;       // one is sent while the next is made
  };

  EventBuffer() : EventBuffer(Limits()) {}
  // All limits are at least 1, and max_events is at least 4 + 2 max_chunks.
  explicit EventBuffer(const Limits& limits) : limits_(limits) {}

  void Put(v1::SolveEvent event);
  // Whether there is room for a chunk of the trajectory.
  bool WantsChunk() const;

  // No more events will be put: the remaining ones come from the finished solve, or the call ends with an error.
  void Close(absl::StatusOr<FinishedSolve> finished);

  enum class Got {
    kEvent,    // `event` was set
    kNothing,  // for now
    kEnd,      // all was delivered; status() says how it ended
  };
  Got Next(v1::SolveEvent& event);
  // has_more(): whether another event is available now. delivered(): whether all events were returned by Next().
  bool has_more() const;
  bool delivered() const;

  bool closed() const;
  // OK before Close(), then OK or the error passed to it.
  absl::Status status() const;
  // The number of queued events, which the limits bound.
  std::size_t size() const;

 private:
  using Queue = std::list<v1::SolveEvent>;

  // Advances `oldest_iterate_`, since that iterate is about to leave the queue.
  void ForgetOldestIterate();
  void DropOldestIterate();
  void DropOldestWindow();
  // The gap is merged with neighboring gaps.
  void ReplaceByGap(Queue::iterator position);

  const Limits limits_;
  mutable std::mutex mutex_;
  Queue queue_;
  // Only ever moves toward the end, so that finding the next one costs O(1) on average. end() when there is
  // none.
  Queue::iterator oldest_iterate_ = queue_.end();
  std::size_t iterates_ = 0;  // queued
  std::size_t chunks_ = 0;    // queued
  std::int64_t conflated_iterates_ = 0;
  std::optional<absl::StatusOr<FinishedSolve>> finished_;
  bool summary_given_ = false;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_EVENT_BUFFER_H_
