// SPDX-License-Identifier: Apache-2.0
#include "tests/server/solve_jobs/job_events.h"

#include <cstdint>
#include <set>

#include "fmt/format.h"

namespace dlcs::testing {

std::string WhatIsWrongWithJobEvents(const std::vector<v1::SolveEvent>& events) {
  if (events.empty()) return "no events";
  std::int64_t last = 0, stored = 0;
  for (const v1::SolveEvent& event : events) {
    if (event.has_heartbeat()) continue;
    const bool gap = event.has_gap();
    const std::int64_t first = gap ? event.gap().first_sequence() : event.sequence();
    if (first != last + 1) return fmt::format("number {} behind {}", first, last);
    if (gap && event.gap().last_sequence() != event.sequence()) return "a gap that ends elsewhere";
    last = event.sequence();
    if (event.has_checkpointed()) {
      if (event.checkpointed().times() < stored) return "fewer stored times than before";
      stored = event.checkpointed().times();
    }
    if (event.has_summary() && &event != &events.back()) return "an event behind the end";
  }
  return events.back().has_summary() ? "" : "the end is missing";
}

bool IsDurableEvent(const v1::SolveEvent& event) {
  return event.kind_case() == v1::SolveEvent::kState || event.has_analysis() || event.has_checkpointed() ||
         event.has_summary();
}

std::string WhatIsMissing(const std::vector<v1::SolveEvent>& events, const std::vector<v1::SolveEvent>& all) {
  std::set<std::int64_t> seen;
  for (const v1::SolveEvent& event : events) {
    if (IsDurableEvent(event)) seen.insert(event.sequence());
  }
  for (const v1::SolveEvent& event : all) {
    if (IsDurableEvent(event) && !seen.contains(event.sequence())) return "without " + event.ShortDebugString();
  }
  return "";
}

}  // namespace dlcs::testing
