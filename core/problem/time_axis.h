// SPDX-License-Identifier: Apache-2.0
// The time of a problem, and the times in it at which something may jump or have a kink.

#ifndef DLCS_CORE_PROBLEM_TIME_AXIS_H_
#define DLCS_CORE_PROBLEM_TIME_AXIS_H_

#include <cstddef>
#include <vector>

namespace dlcs {

// Which limit to take at a time where a function may jump.
enum class Side { kLeft, kRight };

// Two times that differ by no more than this part of them are one that was rounded twice.
inline constexpr double kSameTime = 8 * 2.220446049250313e-16;

// More switching times of formulas than this are refused.
inline constexpr std::size_t kMostSwitchingTimes = 100'000;

// [0, horizon], and what was merged of the break points of all that happens in it.
struct TimeAxis {
  double horizon = 0;
  std::vector<double> break_points = {};  // increasing, inside (0, horizon)

  // The break point, or the end, that is `t` but for rounding; else `t`.
  double Nearest(double t) const;
};

// Times in (0, horizon), `declared` and `found`, as break points: increasing, and of those that are one but for
// rounding one that was declared, or the first.
std::vector<double> MergeBreakPoints(const std::vector<double>& declared, const std::vector<double>& found,
                                     double horizon);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_TIME_AXIS_H_
