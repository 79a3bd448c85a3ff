// SPDX-License-Identifier: Apache-2.0
// The buffer between one solve and its one reader: the engine never waits, the memory is bounded, and the
// reader is told of everything that it did not get.

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
// - Events of the running engine are queued, at most `max_events`. When a reader is so slow that iterates
// fill
//   their share of the queue, the oldest iterate is dropped for each new one. When windows alone fill it (a
//   reader that stopped while thousands of windows went by), the oldest window event is dropped too. What was
//   dropped is replaced, where it stood, by one gap for each run of neighbors. An event takes about 0.3 KB
//   here, so the default is 3 MB at most.
// - The trajectory is not queued. The mailbox keeps the finished solve and makes one chunk when the reader
//   asks for it.
//
// `accepted`, `analysis`, the chunks and the summary are never dropped. The numbers of the events delivered
// are 1, 2, 3, ... except where a gap covers the numbers in between.
//
// Put() and Close() come from the thread of the engine, Next() from any thread, one call at a time.
class EventMailbox {
 public:
  struct Limits {
    std::size_t max_events = 8192;
    std::size_t max_iterates = 4096;  // of max_events
  };

  EventMailbox() : EventMailbox(Limits()) {}
  // Both limits are at least 1, and max_events is at least 4.
  explicit EventMailbox(const Limits& limits) : limits_(limits) {}

  void Put(v1::SolveEvent event);

  // No more events: the rest is in the solve, or there is no result but an error.
  void Close(absl::StatusOr<FinishedSolve> finished);

  enum class Got {
    kEvent,    // `event` was set
    kNothing,  // for now
    kEnd,      // all was delivered; status() tells how it ended
  };
  Got Next(v1::SolveEvent& event);
  // Whether another event waits behind those that Next() gave, and whether there will never be one: it gave all of a
  // solve.
  bool has_more() const;
  bool delivered() const;

  bool closed() const;
  // OK, or the error that Close() was given; OK before.
  absl::Status status() const;
  // Of events queued now: what the limits bound.
  std::size_t size() const;

 private:
  using Queue = std::list<v1::SolveEvent>;

  // Moves `oldest_iterate_` on: the one there is about to leave the queue.
  void ForgetOldestIterate();
  void DropOldestIterate();
  void DropOldestWindow();
  // The gap is joined with gaps beside it.
  void ReplaceByGap(Queue::iterator position);

  const Limits limits_;
  mutable std::mutex mutex_;
  Queue queue_;
  // Only ever moves toward the end, so that finding the next one costs O(1) on average. end() when there is
  // none.
  Queue::iterator oldest_iterate_ = queue_.end();
  std::size_t iterates_ = 0;  // queued
  std::int64_t conflated_iterates_ = 0;
  std::optional<absl::StatusOr<FinishedSolve>> finished_;
  bool summary_given_ = false;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_EVENT_BUFFER_H_
