// SPDX-License-Identifier: Apache-2.0
// Decides when the iteration on a window has converged or diverged, and how wide the next window is.

#ifndef DLCS_CORE_ITERATION_WINDOW_CONTROL_H_
#define DLCS_CORE_ITERATION_WINDOW_CONTROL_H_

#include <vector>

#include "core/discretization/state_archive.h"
#include "core/types.h"

namespace dlcs {

// The longest window that the engine chooses, and the first one if the contraction is not known.
inline constexpr Index kLongestWindow = 2048;
inline constexpr Index kFirstWindow = 16;

// The largest change of a row in units of its size. Rows that are zero up to rounding are measured against the largest
// row.
double RelativeChange(const Vector& size, const Vector& change);

// Whether the last change (by which y may still miss its LCP) and the remaining error (change ρ/(1 - ρ) for a
// contraction by ρ) are both small. Changes at the level of rounding count as converged.
bool Converged(const std::vector<double>& changes, double tolerance);

// Whether the changes are no smaller than some iterations ago.
bool Diverging(const std::vector<double>& changes);

// The most iterations for a window that may shrink, and for one that may not.
inline constexpr Index kMaxIterationsOfShrinking = 300;
inline constexpr Index kMaxIterationsOfFixed = 1000;

// Chooses the width of windows. A window of W steps and k iterations costs k (W + 16) / W per step, since an iteration
// on one step takes about as long as on sixteen (the lanes of core/lcp/structured/policy_iteration.h and overhead per
// iteration). How k grows with W depends on the system: hardly if the iteration is superlinear, linearly if errors grow
// before they decay, like √W if y is coupled by diffusion. So the width is doubled if windows take few iterations, and
// kept if they take some. If they take many, the width moves by factors of two as long as the cost falls, and back when
// it rises.
class WindowWidth {
 public:
  explicit WindowWidth(Index first) : width_(first) {}

  Index value() const { return width_; }
  // A window of `steps` steps took so many `iterations`.
  void Accept(Index steps, Index iterations);
  // A window failed: the next has half of its steps, and for a while windows stay shorter than the failed one.
  void Reject(Index steps);
  // A window of a single step failed and was solved by the coupled LCP: windows stay at one step until the iteration on
  // one converges again.
  void AcceptCoupledStep() { *this = WindowWidth(1); }

  friend void CarryFields(StateArchive& state, WindowWidth& width) {
    state(width.width_, width.cost_, width.grows_, width.ceiling_, width.patience_);
  }

 private:
  void Seek(Index steps, double cost);

  Index width_;
  double cost_ = 0;  // per step, of the last window in the search for a width; 0: none
  bool grows_ = false;
  Index ceiling_ = 0, patience_ = 0;  // the width that failed, and for how many more windows it is a limit
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_WINDOW_CONTROL_H_
