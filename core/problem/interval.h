// SPDX-License-Identifier: Apache-2.0
// Intervals of real numbers whose arithmetic is rounded outward: the result holds every value that the operation has
// for operands within theirs. Elementary functions trust the C library to 4 units in the last place.

#ifndef DLCS_CORE_PROBLEM_INTERVAL_H_
#define DLCS_CORE_PROBLEM_INTERVAL_H_

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/linalg/bounded_sum.h"

namespace dlcs {

struct Interval {
  double lo = 0, hi = 0;

  static Interval Everything() {
    return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  }
  // The result of an operation without a value, such as the root of a negative number.
  static Interval Nothing() {
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  }

  bool is_empty() const { return std::isnan(lo); }
  bool is_bounded() const { return std::isfinite(lo) && std::isfinite(hi); }
  bool is_zero() const { return lo == 0 && hi == 0; }
  bool is_number() const { return lo == hi; }
  bool Contains(double v) const { return lo <= v && v <= hi; }
  double width() const { return hi - lo; }
};

// `v` moved down by at least `ulps` units in the last place; +infinity becomes the largest finite number.
inline double RoundDown(double v, double ulps = 1) {
  if (std::isinf(v)) return v < 0 ? v : std::numeric_limits<double>::max();
  return v - ulps * (std::abs(v) * kUlp + std::numeric_limits<double>::denorm_min());
}
inline double RoundUp(double v, double ulps = 1) { return -RoundDown(-v, ulps); }

// The units in the last place by which a function of the C library may be wrong.
inline constexpr double kLibraryUlps = 4;

inline Interval Widened(double lo, double hi, double ulps = 1) { return {RoundDown(lo, ulps), RoundUp(hi, ulps)}; }

inline Interval Hull(Interval a, Interval b) { return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)}; }

// The intersection; `a` if it is empty because of rounding.
inline Interval Meet(Interval a, Interval b) {
  const Interval both{std::max(a.lo, b.lo), std::min(a.hi, b.hi)};
  return both.lo <= both.hi ? both : a;
}

inline Interval operator-(Interval a) { return {-a.hi, -a.lo}; }

inline Interval operator+(Interval a, Interval b) {
  if (a.is_empty() || b.is_empty()) return Interval::Nothing();
  if (a.is_zero()) return b;
  if (b.is_zero()) return a;
  return Widened(a.lo + b.lo, a.hi + b.hi);
}

inline Interval operator-(Interval a, Interval b) { return a + -b; }

// Whether `a` is ±2^k.
inline bool IsPowerOfTwo(Interval a) {
  int exponent = 0;
  return a.is_number() && std::abs(std::frexp(a.lo, &exponent)) == 0.5;
}

// scale · a for a power of two, which is not rounded unless it leaves the range of normal numbers.
inline Interval ScaledExactly(double scale, Interval a) {
  const Interval scaled = scale > 0 ? Interval{scale * a.lo, scale * a.hi} : Interval{scale * a.hi, scale * a.lo};
  const auto is_exact = [&](double v, double of) { return of == 0 || std::isnormal(v) || std::isinf(of); };
  const bool exact = scale > 0 ? is_exact(scaled.lo, a.lo) && is_exact(scaled.hi, a.hi)
                               : is_exact(scaled.lo, a.hi) && is_exact(scaled.hi, a.lo);
  return exact ? scaled : Widened(scaled.lo, scaled.hi);
}

inline Interval operator*(Interval a, Interval b) {
  if (a.is_empty() || b.is_empty()) return Interval::Nothing();
  if (a.is_zero() || b.is_zero()) return {};
  if (IsPowerOfTwo(a)) return ScaledExactly(a.lo, b);
  if (IsPowerOfTwo(b)) return ScaledExactly(b.lo, a);
  const auto product = [](double x, double y) { return x == 0 || y == 0 ? 0 : x * y; };
  const double ll = product(a.lo, b.lo), lh = product(a.lo, b.hi), hl = product(a.hi, b.lo), hh = product(a.hi, b.hi);
  return Widened(std::min({ll, lh, hl, hh}), std::max({ll, lh, hl, hh}));
}

// The whole line if `b` contains zero.
inline Interval operator/(Interval a, Interval b) {
  if (a.is_empty() || b.is_empty() || b.is_zero()) return Interval::Nothing();
  if (a.is_zero()) return {};
  if (b.Contains(0)) return Interval::Everything();
  return a * Widened(1 / b.hi, 1 / b.lo);
}

// x² of all x in `a`: not a * a, whose operands would be two numbers.
inline Interval Square(Interval a) {
  const double least = a.Contains(0) ? 0 : std::min(std::abs(a.lo), std::abs(a.hi));
  const double most = std::max(std::abs(a.lo), std::abs(a.hi));
  return {std::max(0.0, RoundDown(least * least)), RoundUp(most * most)};
}

// sin over `a`.
Interval Sine(Interval a);
Interval Cosine(Interval a);
// tan over `a`; the whole line if it has a pole there.
Interval Tangent(Interval a);
// a^b; the whole line if it is not finite or not defined for some of the values, Nothing() if for none.
Interval Power(Interval a, Interval b);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_INTERVAL_H_
