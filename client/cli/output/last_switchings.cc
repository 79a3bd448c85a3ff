// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/last_switchings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <vector>

namespace dlcs::client {
namespace {

constexpr int kMany = 32;

// Whether the switchings from number `first` on follow one another so much faster than all together that their times
// accumulate. Others may be many because the horizon is long.
bool Accumulate(const v1::Summary& summary, int first) {
  constexpr double kFaster = 8;
  const auto& all = summary.switching_times();
  const double last = all[all.size() - 1].time();
  const double pace = (last - all[0].time()) / (all.size() - 1);
  return (last - all[first].time()) * kFaster <= pace * (all.size() - 1 - first);
}

}  // namespace

std::string AboutLastSwitchings(const v1::Summary& summary, const DisplayNames& names) {
  const auto& all = summary.switching_times();
  if (summary.termination() != v1::TERMINATION_ITERATION_LIMIT || all.size() < 2) return "";
  if (summary.switchings() > all.size()) return "";
  const v1::SwitchingTime& last = all[all.size() - 1];
  int first = all.size() - 1;
  while (first > 1 && all.size() - first < kMany && all[first].kind() == v1::SWITCHING_KIND_SWITCH) --first;
  const int looked_at = all.size() - first;
  const bool many = looked_at == kMany;
  std::map<int, int> counts;
  for (int k = many ? first : all.size() - 1; k < all.size(); ++k) {
    for (const int pair : all[k].entering()) ++counts[pair];
    for (const int pair : all[k].leaving()) ++counts[pair];
  }
  std::vector<std::string> switching;
  for (const auto& [pair, count] : counts) {
    if (many && count < kMany / 4) continue;
    switching.push_back(names.OfY(static_cast<std::size_t>(pair)));
  }
  if (switching.empty()) return "";
  const std::string who = fmt::format("{}", fmt::join(switching, ", "));
  if (!many) return fmt::format("the last to switch, at t = {:.9g}: {}", last.time(), who);
  const double time = last.time() - all[first].time();
  if (!Accumulate(summary, first)) {
    return fmt::format("switching {} times in the last {:.3g} s, as often as before: {}", looked_at, time, who);
  }
  return fmt::format(
      "{} switch again and again, {} times in the last {:.3g} s: a hysteresis or a delay in what controls "
      "them would slow them down",
      who, looked_at, time);
}

}  // namespace dlcs::client
