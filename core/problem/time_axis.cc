// SPDX-License-Identifier: Apache-2.0
#include "core/problem/time_axis.h"

#include <algorithm>
#include <cmath>

namespace dlcs {

double TimeAxis::Nearest(double t) const {
  const auto above = std::lower_bound(break_points.begin(), break_points.end(), t);
  const auto is_same = [t](double other) { return std::abs(other - t) <= kSameTime * std::abs(t); };
  if (above != break_points.end() && is_same(*above)) return *above;
  if (above != break_points.begin() && is_same(*(above - 1))) return *(above - 1);
  return horizon > 0 && is_same(horizon) ? horizon : t;
}

std::vector<double> MergeBreakPoints(const std::vector<double>& declared, const std::vector<double>& found,
                                     double horizon) {
  struct Mark {
    double time;
    bool is_declared;
  };
  std::vector<Mark> marks;
  for (const double time : declared) marks.push_back({time, true});
  for (const double time : found) marks.push_back({time, false});
  const auto is_earlier = [](const Mark& a, const Mark& b) { return a.time < b.time; };
  if (!std::is_sorted(marks.begin(), marks.end(), is_earlier)) std::sort(marks.begin(), marks.end(), is_earlier);
  std::vector<double> merged;
  bool last_is_declared = false;
  for (const auto& [time, is_declared] : marks) {
    if (!(time > 0 && time < horizon)) continue;
    if (!is_declared && time > horizon * (1 - kSameTime)) continue;
    if (merged.empty() || time - merged.back() > kSameTime * time) {
      merged.push_back(time);
      last_is_declared = is_declared;
    } else if (is_declared && !last_is_declared) {
      merged.back() = time;
      last_is_declared = true;
    }
  }
  return merged;
}

}  // namespace dlcs
