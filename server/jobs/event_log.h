// SPDX-License-Identifier: Apache-2.0
// The events of one job: written by one engine that never waits, read by any number of watchers at their own speed.

#ifndef DLCS_SERVER_JOBS_EVENT_LOG_H_
#define DLCS_SERVER_JOBS_EVENT_LOG_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/store/clock.h"
#include "server/store/event.h"
#include "server/store/event_detail.h"

namespace dlcs::jobs {

class EventLog;
class EventWatch;

// Told when watchers of a log may have something to read. Must not block: the engine's thread calls it.
class EventWaker {
 public:
  virtual ~EventWaker() = default;
  virtual void Wake(std::shared_ptr<EventLog> log) = 0;
};

struct EventLogLimits {
  // Of events in memory, and of their payloads with kEventOverheadBytes each. What leaves first: passing events,
  // oldest first; then kept ones that are in the store. Two things are held whatever the limits say: the newest
  // passing event, and kept events that are on their way to the store.
  std::size_t max_events = 8192;
  std::size_t max_bytes = 4 << 20;
};
inline constexpr std::size_t kEventOverheadBytes = 160;

// How numbers stay unique over crashes. A number is shown to watchers only when
//  - the store has a mark at or above it (Reserve), so that whoever resumes the job begins above it, and
//  - all kept events up to it are in the store (MarkDurable), so that nothing shown can be taken back.
// The engine is not held up by either: it appends, and watchers see it a commit later.
//
// Where events are. Up to `archived_through` the kept ones are in the store alone, and a watcher who is behind that is
// told to read them there (EventWatch::Got::kArchived). Above it they are here. Passing events are here or nowhere.
//
// Threads: all functions are safe from any thread; each holds one mutex for O(log events), Append() also for the
// events it evicts (each once). Made by std::make_shared.
class EventLog : public std::enable_shared_from_this<EventLog> {
 public:
  // Continues after `archived_through`, 0 for a new job. `waker` may be null and must outlive the log.
  EventLog(const EventLogLimits& limits, const Clock& clock, EventWaker* waker, std::int64_t archived_through);

  // Returns the event with its number; 0, and drops it, when the log is closed. A summary closes it.
  Event Append(EventKind kind, std::string payload);

  // Kept events up to `through` are in the store.
  void MarkDurable(std::int64_t through);
  // The store's mark is at `through`.
  void Reserve(std::int64_t through);
  // Where the mark should go: well above the last number once most of the reserved ones are used; 0 when there are
  // plenty.
  std::int64_t WantedReservation() const;

  // Somebody else wrote events up to `through` into the store (the store itself, another server): numbers go on after
  // it. `closed` says that the last of them is the summary. Forgets what is in memory, so nobody may be appending.
  // Does nothing when this log has come as far itself.
  void AdvanceArchive(std::int64_t through, bool closed);
  // A passing event of the server that runs the job, with the number that it has there; the kept events up to
  // `kept_before` are in the store, and there are none between the two. Ignored unless it is newer than all others.
  void AppendRelayed(Event event, std::int64_t kept_before);
  // Somebody else goes on with the job: forgets what no watcher can have seen.
  void Abandon();

  std::int64_t last_sequence() const;
  bool closed() const;
  std::size_t num_events() const;
  std::size_t num_bytes() const;

  // What passing events are to carry for the watchers there are now. Never null.
  std::shared_ptr<const EventDetail> WantedDetail() const;
  // Whether there is a watcher now who wants passing events at all.
  bool HasFullWatchers() const;

  // For the waker: takes the callbacks of the watchers that can go on now into `ready`, and says when the next of the
  // others must be woken (max() when none is waiting).
  Duration TakeReady(std::vector<std::shared_ptr<const std::function<void()>>>& ready);

 private:
  friend class EventWatch;

  struct Choice {
    enum class What { kPassing, kKept, kSupplied, kArchived, kHeartbeat, kWait, kEnd } what = What::kWait;
    const Event* event = nullptr;
    Duration due = Duration::max();  // of kWait
  };

  // The following are called with mutex_ held.
  Choice Choose(const EventWatch& watch, Duration now) const;
  Choice ChooseFromMemory(const EventWatch& watch, Duration now) const;
  std::int64_t VisibleThrough() const;
  bool OverLimits() const;
  void Evict();
  void RestartAfter(std::int64_t sequence);
  // Whether the waker is to be called, since a watcher waits; for a passing event, since one waits that could have it
  // or does not know yet when.
  bool NeedsWake();
  bool NeedsWakeForPassing();
  void WakeIf(bool needed);
  void GatherDetail();

  const EventLogLimits limits_;
  const Clock& clock_;
  EventWaker* const waker_;

  mutable std::mutex mutex_;
  std::deque<Event> passing_;  // both by increasing sequence
  std::deque<Event> kept_;
  std::size_t bytes_ = 0;
  std::int64_t last_ = 0;
  std::int64_t reserved_ = 0;
  std::int64_t durable_ = 0;    // kept events up to here are in the store
  std::int64_t archived_ = 0;   // and up to here they are not in kept_
  std::int64_t forgotten_ = 0;  // passing events up to here are not in passing_
  std::int64_t first_ = 0;      // numbers up to here were used before this log began
  bool closed_ = false;
  bool woken_ = false;                   // the waker was called and has not yet come
  Duration next_due_ = Duration::max();  // what TakeReady() said last
  std::vector<EventWatch*> watches_;
  std::shared_ptr<const EventDetail> wanted_detail_ = std::make_shared<EventDetail>();
};

// Numbers that this watcher will not get.
struct EventGap {
  enum class Why {
    kInterval,     // it asked for fewer
    kSlow,         // it reads more slowly than they come
    kNotRetained,  // they have left the memory of the server, or that server has ended
  };
  std::int64_t first = 0;
  std::int64_t last = 0;
  Why why = Why::kNotRetained;
};

struct EventWatchOptions {
  std::int64_t after = 0;  // begins above this number
  // Passing events are of no interest, and no gap stands for them.
  bool kept_only = false;
  // What it wants passing events to carry. Those that were appended before it came may carry less, all may carry more.
  EventDetail detail = {};
  // Passing events closer together than this are conflated: of each run the newest is delivered.
  Duration min_interval{0};
  // Quiet for so long, a heartbeat is delivered. Proxies cut streams that are silent for a minute.
  Duration heartbeat = std::chrono::seconds(10);
  static constexpr Duration kMaxHeartbeat = std::chrono::seconds(15);
  // More passing events than this waiting for the watcher: it is taken to the newest.
  std::size_t max_backlog = 256;
};

// One watcher's place in a log. Next() and Supply() from one thread at a time.
class EventWatch {
 public:
  enum class Got {
    kEvent,
    kHeartbeat,  // takes no number of its own
    kNothing,    // `ready` will be called, once
    kArchived,   // read the kept events after position() from the store, and Supply() them
    kEnd,        // the summary was delivered, or lies before `after`
  };
  struct Delivery {
    Got got = Got::kNothing;
    std::optional<EventGap> gap;        // stands before `event`
    Event event;                        // of kEvent
    std::int64_t archived_through = 0;  // of kArchived: the store has all kept events up to here
  };

  // `ready` is called from the waker's thread after each kNothing, at most once, and may be called shortly after this
  // object has gone. It must not block. options.heartbeat is cut to kMaxHeartbeat.
  EventWatch(std::shared_ptr<EventLog> log, const EventWatchOptions& options, std::function<void()> ready);
  ~EventWatch();
  EventWatch(const EventWatch&) = delete;
  EventWatch& operator=(const EventWatch&) = delete;

  Delivery Next();

  // Answers kArchived: the kept events after position(), as many as were read, in order. `through` is the number up to
  // which there are no others: the last one's, or Delivery::archived_through when those were all.
  void Supply(std::vector<Event> events, std::int64_t through);

  // All up to this number was delivered or announced as a gap: where to resume.
  std::int64_t position() const { return position_; }

 private:
  friend class EventLog;

  Delivery Deliver(Event event, Duration now);

  const std::shared_ptr<EventLog> log_;
  const EventWatchOptions options_;
  const std::shared_ptr<const std::function<void()>> ready_;

  // CatchExceptions by the log's mutex.
  std::int64_t position_;
  std::deque<Event> supplied_;
  std::int64_t supplied_through_ = 0;
  Duration last_delivery_;
  Duration next_passing_{std::numeric_limits<Duration::rep>::min()};
  bool ended_ = false;
  bool waiting_ = false;
  Duration due_ = Duration::max();
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_EVENT_LOG_H_
