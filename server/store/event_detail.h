// SPDX-License-Identifier: Apache-2.0
// The detail of iterates that watchers want in events.

#ifndef DLCS_SERVER_STORE_EVENT_DETAIL_H_
#define DLCS_SERVER_STORE_EVENT_DETAIL_H_

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <vector>

namespace dlcs::jobs {

// Which values of a vector-valued function of time.
struct EventDetail {
  std::size_t most_times = 0;        // spread over all times; 0: no values
  std::vector<int> components = {};  // increasing; empty: all

  bool operator==(const EventDetail&) const = default;
};

// A detail that contains both.
inline EventDetail Union(const EventDetail& one, const EventDetail& other) {
  if (one.most_times == 0) return other;
  if (other.most_times == 0) return one;
  EventDetail both{.most_times = std::max(one.most_times, other.most_times), .components = {}};
  if (one.components.empty() || other.components.empty()) return both;
  std::ranges::set_union(one.components, other.components, std::back_inserter(both.components));
  return both;
}

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_EVENT_DETAIL_H_
