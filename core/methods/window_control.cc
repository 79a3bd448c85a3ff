// SPDX-License-Identifier: Apache-2.0

#include "core/methods/window_control.h"

#include <algorithm>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// A window that took fewer iterations is doubled next time, one that took more is halved. An iteration costs
// the same per step for any width, so few iterations per window are worth more than few windows.
constexpr Index kFewIterations = 10;
constexpr Index kManyIterations = 20;
// Growth of the change that is taken for divergence where the window may shrink. The hump of a convergent
// iteration can be higher; shrinking is then cheaper than climbing it.
constexpr double kDivergence = 1e3;
// So is a change that is no smaller than this many iterations ago.
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
  constexpr double kRounding = 1e-15;
  if (change <= kRounding) return true;
  if (changes.size() == 1) return false;
  const double contraction = change / changes[changes.size() - 2];
  if (contraction >= 1) return change <= 1e2 * kRounding;
  return change <= tolerance && change * contraction / (1 - contraction) <= tolerance;
}

bool Diverging(const std::vector<double>& changes) {
  const double change = changes.back();
  if (change > kDivergence * std::max(changes.front(), 1e-3)) return true;
  return changes.size() > kPatience && change >= changes[changes.size() - 1 - kPatience];
}

Index NextWidth(Index width, Index steps, Index iterations) {
  if (iterations <= kFewIterations) return std::min(kLongestWindow, std::max(width, 2 * steps));
  if (iterations > kManyIterations) return std::max<Index>(1, steps / 2);
  return width;
}

}  // namespace dlcs
