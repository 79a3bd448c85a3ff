// SPDX-License-Identifier: Apache-2.0
// An event of a job: a number, a time, a kind, and an opaque payload.

#ifndef DLCS_SERVER_STORE_EVENT_H_
#define DLCS_SERVER_STORE_EVENT_H_

#include <cstdint>
#include <memory>
#include <string>

#include "server/store/clock.h"

namespace dlcs::jobs {

// The numbers are stored: never change one, never reuse one.
enum class EventKind {
  kState = 1,           // the payload is JobStateName() of the state entered
  kAnalysis = 2,        // the analysis before the first step
  kWindowAccepted = 3,  // its part of the trajectory is in the store
  kSummary = 4,         // the last event of every job; empty if nothing was solved
  kIterate = 5,
  kWindowStarted = 6,
  kWindowRejected = 7,
  kLog = 8,
  kWindowFinished = 9,  // accepted, and on its way to the store with a later kWindowAccepted
};

// Durable events are in the store before any watcher sees them, and every watcher receives all of them. The others
// ("transient" events) are only in memory for a while; a gap is reported for those that a watcher did not receive.
constexpr bool IsDurable(EventKind kind) { return kind <= EventKind::kSummary; }

struct Event {
  std::int64_t sequence = 0;  // from 1 in every job, increasing, never used twice
  Time time;
  EventKind kind = EventKind::kLog;
  std::shared_ptr<const std::string> payload;  // never null in a delivered event; shared by all watchers
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_EVENT_H_
