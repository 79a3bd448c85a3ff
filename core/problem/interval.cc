// SPDX-License-Identifier: Apache-2.0
#include "core/problem/interval.h"

#include <numbers>

namespace dlcs {
namespace {

using std::numbers::pi;

// Whether `a` may contain first + k · period for a whole number k. Where doubles are too coarse to say no, it may.
bool MayContain(Interval a, double first, double period) {
  const double slack = 8 * std::numeric_limits<double>::epsilon() * std::max(std::abs(a.lo), std::abs(a.hi)) + 1e-300;
  if (!(a.width() + 2 * slack < period)) return true;
  return std::ceil((a.lo - slack - first) / period - 1e-15) <= std::floor((a.hi + slack - first) / period + 1e-15);
}

// Over `a` where sin or cos, `value`, has its maxima at `top` + 2kπ.
template <typename Function>
Interval Wave(Interval a, Function value, double top) {
  const double at_lo = value(a.lo), at_hi = value(a.hi);
  Interval range = Widened(std::min(at_lo, at_hi), std::max(at_lo, at_hi), kLibraryUlps);
  if (MayContain(a, top, 2 * pi)) range.hi = 1;
  if (MayContain(a, top - pi, 2 * pi)) range.lo = -1;
  return {std::max(range.lo, -1.0), std::min(range.hi, 1.0)};
}

// a^n for a whole number n > 0.
Interval WholePower(Interval a, double n) {
  const double at_lo = std::pow(a.lo, n), at_hi = std::pow(a.hi, n);
  if (std::fmod(n, 2) != 0) return Widened(at_lo, at_hi, kLibraryUlps);
  Interval range = Widened(a.Contains(0) ? 0 : std::min(at_lo, at_hi), std::max(at_lo, at_hi), kLibraryUlps);
  range.lo = std::max(range.lo, 0.0);
  return range;
}

}  // namespace

Interval Sine(Interval a) {
  if (a.is_empty()) return a;
  if (!a.is_bounded()) return {-1, 1};
  return Wave(
      a, [](double v) { return std::sin(v); }, pi / 2);
}

Interval Cosine(Interval a) {
  if (a.is_empty()) return a;
  if (!a.is_bounded()) return {-1, 1};
  return Wave(
      a, [](double v) { return std::cos(v); }, 0);
}

Interval Tangent(Interval a) {
  if (a.is_empty()) return a;
  if (!a.is_bounded() || MayContain(a, pi / 2, pi)) return Interval::Everything();
  return Widened(std::tan(a.lo), std::tan(a.hi), kLibraryUlps);
}

Interval Power(Interval a, Interval b) {
  if (a.is_empty() || b.is_empty()) return Interval::Nothing();
  if (b.is_zero()) return {1, 1};
  if (b.is_number() && std::isfinite(b.lo)) {
    const double n = b.lo;
    if (n == 1) return a;
    if (n == 2) return Square(a);
    if (n == std::floor(n)) return n > 0 ? WholePower(a, n) : Interval{1, 1} / WholePower(a, -n);
    if (a.hi < 0) return Interval::Nothing();
    if (a.lo < 0 || (n < 0 && a.lo == 0)) return Interval::Everything();
    const double at_lo = std::pow(a.lo, n), at_hi = std::pow(a.hi, n);
    Interval range = Widened(std::min(at_lo, at_hi), std::max(at_lo, at_hi), kLibraryUlps);
    range.lo = std::max(range.lo, 0.0);
    return range;
  }
  if (a.lo < 0 || (a.lo == 0 && b.lo <= 0) || !a.is_bounded() || !b.is_bounded()) return Interval::Everything();
  // Monotone in each of the two, so that the extremes are at corners.
  const double ll = std::pow(a.lo, b.lo), lh = std::pow(a.lo, b.hi), hl = std::pow(a.hi, b.lo),
               hh = std::pow(a.hi, b.hi);
  Interval range = Widened(std::min({ll, lh, hl, hh}), std::max({ll, lh, hl, hh}), kLibraryUlps);
  range.lo = std::max(range.lo, 0.0);
  return range;
}

}  // namespace dlcs
