// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/last_switchings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <vector>

namespace dlcs::client {

std::string AboutLastSwitchings(const v1::Summary& summary, const DisplayNames& names) {
  constexpr int kMany = 32;
  const auto& all = summary.switching_times();
  if (summary.termination() != v1::TERMINATION_ITERATION_LIMIT || all.size() < 2) return "";
  if (summary.switchings() > all.size()) return "";
  const v1::SwitchingTime& last = all[all.size() - 1];
  int first = all.size() - 1;
  while (first > 1 && all.size() - first < kMany && all[first].kind() == v1::SWITCHING_KIND_SWITCH) --first;
  const int looked_at = all.size() - first;
  const bool again_and_again = looked_at == kMany;
  std::map<int, int> counts;
  for (int k = again_and_again ? first : all.size() - 1; k < all.size(); ++k) {
    for (const int pair : all[k].entering()) ++counts[pair];
    for (const int pair : all[k].leaving()) ++counts[pair];
  }
  std::vector<std::string> switching;
  for (const auto& [pair, count] : counts) {
    if (again_and_again && count < kMany / 4) continue;
    switching.push_back(names.OfY(static_cast<std::size_t>(pair)));
  }
  if (switching.empty()) return "";
  if (!again_and_again)
    return fmt::format("the last to switch, at t = {:.9g}: {}", last.time(), fmt::join(switching, ", "));
  return fmt::format(
      "{} switch again and again, {} times in the last {:.3g} s: a hysteresis or a delay in what controls "
      "them would slow them down",
      fmt::join(switching, ", "), looked_at, last.time() - all[first].time());
}

}  // namespace dlcs::client
