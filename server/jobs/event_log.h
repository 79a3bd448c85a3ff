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

// Notified when watchers of a log may have something to read. Must not block: the engine's thread calls it.
class EventWaker {
 public:
  virtual ~EventWaker() = default;
  virtual void Wake(std::shared_ptr<EventLog> log) = 0;
};

struct EventLogLimits {
  // Limits of the number of events in memory, and of the bytes of their payloads with kEventOverheadBytes each. Passing
  // events are dropped first, oldest first; then durable events that are in the store. The newest transient event, and
  // durable events that are not yet in the store, are held in spite of the limits.
  std::size_t max_events = 8192;
  std::size_t max_bytes = 4 << 20;
};
inline constexpr std::size_t kEventOverheadBytes = 160;

// How numbers remain unique over crashes. A number is shown to watchers only when
//  - the store has a mark at or above it (Reserve), so that a server that resumes the job begins above it, and
//  - all durable events up to it are in the store (MarkStored), so that nothing shown can be lost.
// The engine does not wait for either: it appends, and watchers see the event one commit later.
//
// Where events are. Durable events up to `archived_through` are only in the store, and a watcher before that number has
// to read them there (EventWatch::Got::kArchived). Later ones are in this log. Transient events are only in this log.
//
// Threads: all functions are safe from any thread; each holds one mutex for O(log events), Append() also for the
// events it evicts (each once). Made by std::make_shared.
class EventLog : public std::enable_shared_from_this<EventLog> {
 public:
  // Continues after `archived_through`, 0 for a new job. `waker` may be null and must outlive the log.
  EventLog(const EventLogLimits& limits, const Clock& clock, EventWaker* waker, std::int64_t archived_through);

  // Returns the event with its number; 0, and drops it, when the log is closed. A summary closes it.
  Event Append(EventKind kind, std::string payload);

  // Durable events up to `through` are in the store.
  void MarkStored(std::int64_t through);
  // The store's mark is at `through`.
  void Reserve(std::int64_t through);
  // Where the mark should go: well above the last number once most of the reserved ones are used; 0 when there are
  // plenty.
  std::int64_t WantedReservation() const;

  // Another writer (the store itself, another server) has written events up to `through` into the store: numbers
  // continue after it. `closed` says that the last of them is the summary. Drops all events in memory, so nothing may
  // be appending. Does nothing if this log has reached `through` itself.
  void AdvanceArchive(std::int64_t through, bool closed);
  // A transient event of the server that runs the job, with the number that it has there; the durable events up to
  // `durable_before` are in the store, and there are none between the two. Ignored unless it is newer than all others.
  void AppendRelayed(Event event, std::int64_t durable_before);
  // Another server has resumed the job: drops the events that no watcher can have seen.
  void Abandon();

  std::int64_t last_sequence() const;
  bool closed() const;
  std::size_t num_events() const;
  std::size_t num_bytes() const;

  // The detail that the current watchers want in transient events. Never null.
  std::shared_ptr<const EventDetail> WantedDetail() const;
  // Whether any current watcher wants transient events.
  bool HasFullWatchers() const;

  // For the waker: adds the callbacks of the watchers that can continue now to `ready`. Returns when the next of the
  // others must be woken (max() if none is waiting).
  Duration TakeReady(std::vector<std::shared_ptr<const std::function<void()>>>& ready);

 private:
  friend class EventWatch;

  struct Choice {
    enum class What { kTransient, kDurable, kSupplied, kArchived, kHeartbeat, kWait, kEnd } what = What::kWait;
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
  // Whether the waker must be called because a watcher is waiting.
  bool NeedsWake();
  bool NeedsWakeForTransient();
  void WakeIf(bool needed);
  void GatherDetail();

  const EventLogLimits limits_;
  const Clock& clock_;
  EventWaker* const waker_;

  mutable std::mutex mutex_;
  std::deque<Event> transient_;  // both by increasing sequence
  std::deque<Event> durable_;
  std::size_t bytes_ = 0;
  std::int64_t last_ = 0;
  std::int64_t reserved_ = 0;
  std::int64_t stored_ = 0;     // durable events up to this number are in the store
  std::int64_t archived_ = 0;   // durable events up to this number are no longer in durable_
  std::int64_t forgotten_ = 0;  // transient events up to this number are no longer in transient_
  std::int64_t first_ = 0;      // numbers up to here were used before this log began
  bool closed_ = false;
  bool woken_ = false;                   // the waker was called and has not yet called TakeReady()
  Duration next_due_ = Duration::max();  // the last result of TakeReady()
  std::vector<EventWatch*> watches_;
  std::shared_ptr<const EventDetail> wanted_detail_ = std::make_shared<EventDetail>();
};

// Numbers of events that this watcher will not receive.
struct EventGap {
  enum class Why {
    kInterval,     // its options limit the rate
    kSlow,         // it reads too slowly
    kNotRetained,  // they have left the memory of the server, or that server has ended
  };
  std::int64_t first = 0;
  std::int64_t last = 0;
  Why why = Why::kNotRetained;
};

struct EventWatchOptions {
  std::int64_t after = 0;  // begins above this number
  // Transient events are neither delivered nor reported as gaps.
  bool durable_only = false;
  // The detail it wants in transient events. Events appended before the watch began may have less; all may have more.
  EventDetail detail = {};
  // Transient events closer together than this are conflated: of each run the newest is delivered.
  Duration min_interval{0};
  // A heartbeat is delivered after so long without an event. Proxies cut streams that are silent for a minute.
  Duration heartbeat = std::chrono::seconds(10);
  static constexpr Duration kMaxHeartbeat = std::chrono::seconds(15);
  // If more transient events than this are waiting, the watcher skips to the newest.
  std::size_t max_backlog = 256;
};

// One watcher's place in a log. Next() and Supply() from one thread at a time.
class EventWatch {
 public:
  enum class Got {
    kEvent,
    kHeartbeat,  // has no number
    kNothing,    // `ready` will be called, once
    kArchived,   // read the durable events after position() from the store, and Supply() them
    kEnd,        // the summary was delivered, or lies before `after`
  };
  struct Delivery {
    Got got = Got::kNothing;
    std::optional<EventGap> gap;        // comes before `event`
    Event event;                        // of kEvent
    std::int64_t archived_through = 0;  // of kArchived: the store has all durable events up to here
  };

  // `ready` is called from the waker's thread after each kNothing, at most once, and may be called shortly after this
  // object was destroyed. It must not block. options.heartbeat is cut to kMaxHeartbeat.
  EventWatch(std::shared_ptr<EventLog> log, const EventWatchOptions& options, std::function<void()> ready);
  ~EventWatch();
  EventWatch(const EventWatch&) = delete;
  EventWatch& operator=(const EventWatch&) = delete;

  Delivery Next();
  // Whether Next() would return an event.
  bool has_more() const;

  // Answers kArchived: the durable events after position(), as many as were read, in order. `through` is the number up
  // to which there are no others: the last one's, or Delivery::archived_through when those were all.
  void Supply(std::vector<Event> events, std::int64_t through);

  // All events up to this number were delivered or reported as a gap: the number to resume from.
  std::int64_t position() const { return position_; }

 private:
  friend class EventLog;

  Delivery Deliver(Event event, Duration now);

  const std::shared_ptr<EventLog> log_;
  const EventWatchOptions options_;
  const std::shared_ptr<const std::function<void()>> ready_;

  // Guarded by the log's mutex.
  std::int64_t position_;
  std::deque<Event> supplied_;
  std::int64_t supplied_through_ = 0;
  Duration last_delivery_;
  Duration next_transient_{std::numeric_limits<Duration::rep>::min()};
  bool ended_ = false;
  bool waiting_ = false;
  Duration due_ = Duration::max();
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_JOBS_EVENT_LOG_H_
