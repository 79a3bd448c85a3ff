// SPDX-License-Identifier: Apache-2.0
// When the iteration on a window has converged or diverged, and how wide the next window is to be.

#ifndef DLCS_CORE_ITERATION_WINDOW_CONTROL_H_
#define DLCS_CORE_ITERATION_WINDOW_CONTROL_H_

#include <vector>

#include "core/discretization/state_archive.h"
#include "core/types.h"

namespace dlcs {

// The longest window that is chosen without being asked for, and the first when nothing is known of the contraction.
inline constexpr Index kLongestWindow = 2048;
inline constexpr Index kFirstWindow = 16;

// The largest change of a row in units of its size. Rows that vanish but for rounding are measured against the largest
// one.
double RelativeChange(const Vector& size, const Vector& change);

// Stops when the change, which is what y still owes its LCP, and the error that is left, which for a contraction
// by ρ is change ρ/(1 - ρ), are both small. Changes at the level of rounding cannot contract any more.
bool Converged(const std::vector<double>& changes, double tolerance);

// Whether the changes grew too far to be worth waiting, or are no smaller than some iterations ago.
bool Diverging(const std::vector<double>& changes);

// The iterations that a window may take: one that may shrink, or one that may not.
inline constexpr Index kMostIterationsOfShrinking = 300;
inline constexpr Index kMostIterationsOfFixed = 1000;

// How wide windows are where that is chosen. A window of W steps and k iterations costs k (W + 16) / W a step, since an
// iteration of one step takes about as long as one of sixteen (the lanes of core/lcp/structured/policy_iteration.h, and
// what is done once an iteration). How k grows with W depends on the system: hardly where the iteration is superlinear,
// linearly in the hump, like √W where diffusion carries y to y. So where windows take few iterations they are doubled,
// where some they are kept, and where many the width moves by factors of two as long as the cost falls, and back where
// it rises.
class WindowWidth {
 public:
  explicit WindowWidth(Index first) : width_(first) {}

  Index value() const { return width_; }
  // A window of `steps` steps took so many `iterations`.
  void Accept(Index steps, Index iterations);
  // One failed: the next has half of its steps, and windows whose width is sought stay below it for a while.
  void Reject(Index steps);
  // One of a single step failed and was marched: there is no use in trying more before one step iterates again.
  void March() { *this = WindowWidth(1); }

  friend void CarryFields(StateArchive& state, WindowWidth& width) {
    state(width.width_, width.cost_, width.grows_, width.ceiling_, width.patience_);
  }

 private:
  void Seek(Index steps, double cost);

  Index width_;
  double cost_ = 0;  // a step, of the last window whose width was sought; 0: none
  bool grows_ = false;
  Index ceiling_ = 0, patience_ = 0;  // the width that failed, and for how many windows that is remembered
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_WINDOW_CONTROL_H_
