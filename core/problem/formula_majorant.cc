// SPDX-License-Identifier: Apache-2.0
#include "core/problem/formula_majorant.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace dlcs {
namespace {

using enum FormulaOperation;

constexpr int kOrder = TaylorBounds::kOrder;

// A part of a formula that is nowhere larger is zero to the whole, whose values are larger by far more than an ulp. So
// what overflows in a denominator, or vanishes in an exponential, has no derivatives to bound.
// ShortPulseTest.OfOneIsNotMissedBesideAnything fails without it.
constexpr double kVanishes = 1e-200;

double Largest(Interval a) {
  return a.is_empty() ? std::numeric_limits<double>::infinity() : std::max(std::abs(a.lo), std::abs(a.hi));
}
// The smallest absolute value; 0 if a value is 0.
double Smallest(Interval a) { return a.is_empty() || a.Contains(0) ? 0 : std::min(std::abs(a.lo), std::abs(a.hi)); }
// The smallest value if all are above 0, otherwise 0.
double Positive(Interval a) { return a.lo > 0 ? a.lo : 0; }

void FindDegree(TaylorBounds& bounds) {
  bounds.degree = kOrder;
  while (bounds.degree > 0 && bounds[bounds.degree] == 0) --bounds.degree;
}

// Σ_{j = 1..k} weight(j) a_j b_{k-j}
template <typename Weight>
double Convolve(const TaylorBounds& a, const TaylorBounds& b, int k, const Weight& weight) {
  double sum = 0;
  for (int j = std::max(1, k - b.degree); j <= std::min(k, a.degree); ++j) sum += weight(j) * a[j] * b[k - j];
  return sum;
}

int Itself(int j) { return j; }

TaylorBounds Sum(const TaylorBounds& a, const TaylorBounds& b) {
  TaylorBounds sum = a;
  for (int k = 0; k <= b.degree; ++k) sum[k] += b[k];
  sum.degree = std::max(a.degree, b.degree);
  return sum;
}

TaylorBounds Larger(const TaylorBounds& a, const TaylorBounds& b) {
  TaylorBounds larger;
  for (int k = 0; k <= kOrder; ++k) larger[k] = std::max(a[k], b[k]);
  larger.degree = std::max(a.degree, b.degree);
  return larger;
}

TaylorBounds Product(const TaylorBounds& a, const TaylorBounds& b) {
  TaylorBounds product;
  for (int j = 0; j <= a.degree; ++j) {
    for (int k = 0; k <= std::min(b.degree, kOrder - j); ++k) product[j + k] += a[j] * b[k];
  }
  FindDegree(product);
  return product;
}

// u / number, without the overflow of products with large numbers.
TaylorBounds Over(const TaylorBounds& u, double number) {
  TaylorBounds quotient;
  quotient.degree = u.degree;
  for (int k = 0; k <= u.degree; ++k) quotient[k] = u[k] / number;
  return quotient;
}

// All of whose coefficients may differ from 0 until FindDegree().
TaylorBounds Beginning(double first) {
  TaylorBounds bounds;
  bounds[0] = first;
  bounds.degree = kOrder;
  return bounds;
}

// The series whose coefficient k is `next`(those before, k).
template <typename Next>
TaylorBounds Recur(double first, const Next& next) {
  TaylorBounds bounds = Beginning(first);
  for (int k = 1; k <= kOrder; ++k) bounds[k] = next(bounds, k);
  FindDegree(bounds);
  return bounds;
}

// q b = a
TaylorBounds Quotient(const TaylorBounds& a, const TaylorBounds& b, double smallest_b, double largest) {
  const TaylorBounds a_over = Over(a, smallest_b), b_over = Over(b, smallest_b);
  return Recur(largest,
               [&](const TaylorBounds& q, int k) { return a_over[k] + Convolve(b_over, q, k, [](int) { return 1; }); });
}

// y' = slope u'
TaylorBounds Integral(const TaylorBounds& slope, const TaylorBounds& u, double largest) {
  return Recur(largest, [&](const TaylorBounds&, int k) { return Convolve(u, slope, k, Itself) / k; });
}

// e' = e u'
TaylorBounds Exponential(const TaylorBounds& u, double largest) {
  return Recur(largest, [&](const TaylorBounds& e, int k) { return Convolve(u, e, k, Itself) / k; });
}

// u l' = u'
TaylorBounds Logarithm(const TaylorBounds& u, double smallest_u, double largest) {
  const TaylorBounds u_over = Over(u, smallest_u);
  return Recur(largest, [&](const TaylorBounds& l, int k) {
    return u_over[k] + Convolve(u_over, l, k, [k](int j) { return k - j; }) / k;
  });
}

// u p' = exponent p u'
TaylorBounds Power(const TaylorBounds& u, double exponent, double smallest_u, double largest) {
  const TaylorBounds u_over = Over(u, smallest_u);
  return Recur(largest, [&](const TaylorBounds& p, int k) {
    return Convolve(u_over, p, k, [&](int j) { return std::abs(exponent * j - (k - j)); }) / k;
  });
}

// By repeated squaring, where u may be 0.
TaylorBounds WholePower(TaylorBounds u, double exponent) {
  TaylorBounds power;
  power[0] = 1;
  while (true) {
    if (std::fmod(exponent, 2) == 1) power = Product(power, u);
    exponent = std::floor(exponent / 2);
    if (!(exponent > 0)) return power;
    u = Product(u, u);
  }
}

// odd' = even u', even' = ±odd u', for bounds of their values.
std::pair<TaylorBounds, TaylorBounds> OddAndEven(const TaylorBounds& u, double largest_odd, double largest_even) {
  TaylorBounds odd = Beginning(largest_odd), even = Beginning(largest_even);
  for (int k = 1; k <= kOrder; ++k) {
    odd[k] = Convolve(u, even, k, Itself) / k;
    even[k] = Convolve(u, odd, k, Itself) / k;
  }
  FindDegree(odd);
  FindDegree(even);
  return {odd, even};
}

// y' = (1 ± y²) u'
TaylorBounds OfRiccati(const TaylorBounds& u, double largest, double largest_slope) {
  TaylorBounds slope = Beginning(largest_slope);
  return Recur(largest, [&](TaylorBounds& y, int k) {
    y[k] = Convolve(u, slope, k, Itself) / k;
    for (int j = 0; j <= k; ++j) slope[k] += y[j] * y[k - j];
    return y[k];
  });
}

// y' = p^exponent u' for p = 1 ± u², whose values are in `range`.
TaylorBounds ArcOf(const TaylorBounds& u, Interval range, double exponent, double largest) {
  TaylorBounds p = Product(u, u);
  p[0] = Largest(range);
  return Integral(Power(p, exponent, Positive(range), std::pow(Positive(range), exponent)), u, largest);
}

}  // namespace

FormulaMajorant::FormulaMajorant(const FormulaTree& tree)
    : tree_(tree), enclosure_(tree, {.has_value = true}), bounds_(tree.steps.size()) {}

double FormulaMajorant::value_at_middle() const {
  return Largest(enclosure_.value_at_middle(static_cast<int>(tree_.steps.size()) - 1));
}

void FormulaMajorant::Evaluate(double lo, double hi) {
  enclosure_.Evaluate(lo, lo + (hi - lo) / 2, hi);
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    const int step = static_cast<int>(i);
    const double largest = Largest(enclosure_.value(step));
    bounds_[i] = largest <= kVanishes ? TaylorBounds() : BoundsOf(step, (hi - lo) / 2);
    bounds_[i][0] = largest;
  }
}

// All but the first, which is that of the enclosure.
TaylorBounds FormulaMajorant::BoundsOf(int index, double radius) const {
  constexpr Interval kOne{1, 1};
  const FormulaStep& step = tree_.steps[static_cast<std::size_t>(index)];
  const TaylorBounds none;
  const TaylorBounds& u = step.a < 0 ? none : bounds_[static_cast<std::size_t>(step.a)];
  const TaylorBounds& v = step.b < 0 ? none : bounds_[static_cast<std::size_t>(step.b)];
  const Interval of_u = step.a < 0 ? Interval{} : enclosure_.value(step.a);
  const Interval value = enclosure_.value(index);
  const double largest = Largest(value);
  switch (step.operation) {
    case kTime: {
      TaylorBounds time;
      time[1] = radius;
      time.degree = 1;
      return time;
    }
    case kNegate:
    case kAbs:
      return u;
    case kAdd:
    case kSubtract:
      return Sum(u, v);
    case kMin:
    case kMax: {
      // One of the two over the whole interval, known which or not.
      const Interval d = enclosure_.decider(index).value;
      if (step.operation == kMin ? d.hi <= 0 : d.lo >= 0) return u;
      return (step.operation == kMin ? d.lo >= 0 : d.hi <= 0) ? v : Larger(u, v);
    }
    case kMultiply:
      return Product(u, v);
    case kDivide:
      return Quotient(u, v, Smallest(enclosure_.value(step.b)), largest);
    case kPower:
      return BoundsOfPower(step, u, largest);
    case kSin:
      return OddAndEven(u, Largest(Sine(of_u)), Largest(Cosine(of_u))).first;
    case kCos:
      return OddAndEven(u, Largest(Sine(of_u)), Largest(Cosine(of_u))).second;
    case kSinh:
      return OddAndEven(u, std::sinh(Largest(of_u)), std::cosh(Largest(of_u))).first;
    case kCosh:
      return OddAndEven(u, std::sinh(Largest(of_u)), std::cosh(Largest(of_u))).second;
    case kTan:
      return OfRiccati(u, largest, 1 + largest * largest);
    case kTanh:
      return OfRiccati(u, largest, Largest(kOne - Square(value)));
    case kAsin:
    case kAcos:
      return ArcOf(u, kOne - Square(of_u), -0.5, largest);
    case kAtan:
      return ArcOf(u, kOne + Square(of_u), -1, largest);
    case kExp:
      return Exponential(u, largest);
    case kLog:
    case kLog10: {
      TaylorBounds logarithm = Logarithm(u, Positive(of_u), largest);
      if (step.operation == kLog10) {
        for (double& c : logarithm.c) c /= std::numbers::ln10;
      }
      return logarithm;
    }
    case kSqrt:
      return Power(u, 0.5, Positive(of_u), largest);
    default:  // numbers, and switches that are constant between break points
      return none;
  }
}

TaylorBounds FormulaMajorant::BoundsOfPower(const FormulaStep& step, const TaylorBounds& u, double largest) const {
  const Interval base = enclosure_.value(step.a), exponent = enclosure_.value(step.b);
  const TaylorBounds& v = bounds_[static_cast<std::size_t>(step.b)];
  if (exponent.is_number() && v.degree == 0) {
    const double power = exponent.lo;
    const bool is_whole = power == std::floor(power);
    const bool is_polynomial = is_whole && power >= 0 && power * u.degree <= kOrder;
    if (is_polynomial || (is_whole && power >= 0 && base.Contains(0))) return WholePower(u, power);
    const double smallest = is_whole ? Smallest(base) : Positive(base);
    return Power(u, power, smallest, largest);
  }
  const double largest_logarithm = std::max(std::abs(std::log(base.lo)), std::abs(std::log(base.hi)));
  const TaylorBounds logarithm = Logarithm(u, Positive(base), largest_logarithm);
  return Exponential(Product(v, logarithm), largest);
}

}  // namespace dlcs
