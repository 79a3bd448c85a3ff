// SPDX-License-Identifier: Apache-2.0

#include "core/iteration/window_control.h"

#include <algorithm>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// After at most kFewIterations the next window is doubled. After more than kManyIterations a better width is sought.
constexpr Index kFewIterations = 10;
constexpr Index kManyIterations = 20;
// The fixed cost of an iteration, in units of the cost of a step.
constexpr Index kStepsOfOverhead = 16;
// The number of windows for which a width that failed is not tried again.
constexpr Index kMemory = 8;
// A change that is no smaller than it was this many iterations ago counts as divergence. A convergent iteration may
// grow for longer, but then a shorter window is cheaper.
constexpr size_t kPatience = 5;

}  // namespace

double RelativeChange(const Vector& size, const Vector& change) {
  constexpr double kVanishing = 1e-10;
  const double largest = MaxAbs(size);
  if (largest == 0) return MaxAbs(change);
  return MaxAbs(change.cwiseQuotient(size.cwiseMax(kVanishing * largest)));
}

bool Converged(const std::vector<double>& changes, double tolerance) {
  const double change = changes.back();
  if (change <= RoundingOf(8)) return true;
  if (changes.size() == 1) return false;
  const double contraction = change / changes[changes.size() - 2];
  if (contraction >= 1) return change <= RoundingOf(1024);
  return change <= tolerance && change * contraction / (1 - contraction) <= tolerance;
}

bool Diverging(const std::vector<double>& changes) {
  return changes.size() > kPatience && changes.back() >= changes[changes.size() - 1 - kPatience];
}

void WindowWidth::Accept(Index steps, Index iterations) {
  if (patience_ > 0) --patience_;
  if (iterations > kManyIterations) {
    const auto taken = static_cast<double>(iterations);
    return Seek(steps, taken * static_cast<double>(steps + kStepsOfOverhead) / static_cast<double>(steps));
  }
  cost_ = 0;
  grows_ = false;
  if (iterations <= kFewIterations) width_ = std::min(kLongestWindow, std::max(width_, 2 * steps));
}

void WindowWidth::Seek(Index steps, double cost) {
  const bool rose = cost_ > 0 && cost >= cost_;
  cost_ = cost;
  if (rose) grows_ = !grows_;
  if (steps == 1) grows_ = true;
  const Index wider = std::min(kLongestWindow, 2 * steps);
  const bool may_grow = wider > steps && (patience_ == 0 || wider < ceiling_);
  width_ = grows_ && may_grow ? wider : grows_ ? steps : std::max<Index>(1, steps / 2);
}

void WindowWidth::Reject(Index steps) {
  *this = WindowWidth(std::max<Index>(1, steps / 2));
  ceiling_ = steps;
  patience_ = kMemory;
}

}  // namespace dlcs
