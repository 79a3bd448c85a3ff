// SPDX-License-Identifier: Apache-2.0
// The time of a problem, and the times in it at which something may jump or have a kink.

#ifndef DLCS_CORE_PROBLEM_TIME_AXIS_H_
#define DLCS_CORE_PROBLEM_TIME_AXIS_H_

#include <cstddef>
#include <vector>

namespace dlcs {

// Which limit to take at a time where a function may jump.
enum class Side { kLeft, kRight };

// Two times with a relative difference of at most this are the same time, rounded differently.
inline constexpr double kSameTime = 8 * 2.220446049250313e-16;

// More switching times of formulas than this are refused.
inline constexpr std::size_t kMaxSwitchingTimes = 100'000;

// [0, horizon] with the merged break points of all sources.
struct TimeAxis {
  double horizon = 0;
  std::vector<double> break_points = {};  // increasing, inside (0, horizon)

  // The break point or the end that equals `t` up to rounding; otherwise `t`.
  double Nearest(double t) const;
};

// Merges the times `declared` and `found` in (0, horizon) into increasing break points. Of times that are equal up to
// rounding it keeps a declared one, or the first.
std::vector<double> MergeBreakPoints(const std::vector<double>& declared, const std::vector<double>& found,
                                     double horizon);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_TIME_AXIS_H_
