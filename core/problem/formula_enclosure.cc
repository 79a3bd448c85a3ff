// SPDX-License-Identifier: Apache-2.0
#include "core/problem/formula_enclosure.h"

namespace dlcs {
namespace {

using enum FormulaOperation;

constexpr Interval kOne{1, 1};

template <double (*function)(double)>
Interval Increasing(Interval a) {
  return a.is_empty() ? a : Widened(function(a.lo), function(a.hi), kLibraryUlps);
}

// An increasing function on [least, most], of `a`.
template <double (*function)(double)>
Interval IncreasingWithin(Interval a, double least, double most) {
  if (a.is_empty() || a.hi < least || a.lo > most) return Interval::Nothing();
  return a.lo < least || a.hi > most ? Interval::Everything() : Increasing<function>(a);
}

Interval Logarithm(Interval a, double (*function)(double)) {
  if (a.is_empty() || a.hi < 0) return Interval::Nothing();
  return a.lo <= 0 ? Interval::Everything() : Widened(function(a.lo), function(a.hi), kLibraryUlps);
}

Interval SquareRoot(Interval a) {
  if (a.is_empty() || a.hi < 0) return Interval::Nothing();
  if (a.lo < 0) return Interval::Everything();
  return {std::max(0.0, RoundDown(std::sqrt(a.lo))), RoundUp(std::sqrt(a.hi))};
}

Interval NotNegative(Interval a) { return {std::max(a.lo, 0.0), a.hi}; }

enum class Truth { kNever, kAlways, kPerhaps };

// Whether a comparison holds for two numbers whose difference is in `d`.
Truth TruthOf(FormulaOperation operation, Interval d) {
  if (d.is_empty()) return operation == kNotEqual ? Truth::kAlways : Truth::kNever;
  const auto truth = [](bool never, bool always) {
    return never ? Truth::kNever : always ? Truth::kAlways : Truth::kPerhaps;
  };
  switch (operation) {
    case kLess:
      return truth(d.lo >= 0, d.hi < 0);
    case kLessEqual:
      return truth(d.lo > 0, d.hi <= 0);
    case kGreater:
      return truth(d.hi <= 0, d.lo > 0);
    case kGreaterEqual:
      return truth(d.hi < 0, d.lo >= 0);
    case kEqual:
      return truth(d.lo > 0 || d.hi < 0, d.is_zero());
    default:
      return truth(d.is_zero(), d.lo > 0 || d.hi < 0);
  }
}

Enclosure EncloseSwitch(FormulaOperation operation, const Enclosure& a, const Enclosure& b, Interval d) {
  if (IsComparison(operation)) {
    const Truth truth = TruthOf(operation, d);
    if (truth == Truth::kPerhaps) return {{0, 1}, Interval::Everything()};
    return {truth == Truth::kAlways ? kOne : Interval{}, {}};
  }
  if (d.is_empty()) return {Interval::Nothing(), Interval::Everything()};
  switch (operation) {
    case kMin:
      if (d.hi <= 0) return a;
      if (d.lo >= 0) return b;
      return {{std::min(a.value.lo, b.value.lo), std::min(a.value.hi, b.value.hi)}, Hull(a.slope, b.slope)};
    case kMax:
      if (d.lo >= 0) return a;
      if (d.hi <= 0) return b;
      return {{std::max(a.value.lo, b.value.lo), std::max(a.value.hi, b.value.hi)}, Hull(a.slope, b.slope)};
    case kAbs:
      if (d.lo >= 0) return a;
      if (d.hi <= 0) return {-a.value, -a.slope};
      return {{0, std::max(-d.lo, d.hi)}, Hull(a.slope, -a.slope)};
    default: {
      const double lo = ValueOf(operation, d.lo, 0), hi = ValueOf(operation, d.hi, 0);
      return {{lo, hi}, lo == hi ? Interval{} : Interval::Everything()};
    }
  }
}

// Powers whose exponent is one of the whole numbers in `exponent`: of a negative base, others are not defined.
Interval PowerOfWholes(Interval base, Interval exponent) {
  constexpr Index kMost = 16;
  const double first = std::ceil(exponent.lo), last = std::floor(exponent.hi);
  if (exponent.is_empty() || !(last - first < kMost) || last < first) return Power(base, exponent);
  Interval powers = Power(base, {first, first});
  for (double n = first + 1; n <= last; ++n) powers = Hull(powers, Power(base, {n, n}));
  return powers;
}

// The part of `a` in the domain of the operation; `a` if there is none.
Interval InDomain(FormulaOperation operation, Interval a) {
  if (operation == kSqrt && a.hi >= 0) return {std::max(a.lo, 0.0), a.hi};
  if ((operation == kAsin || operation == kAcos) && a.lo <= 1 && a.hi >= -1) {
    return {std::max(a.lo, -1.0), std::min(a.hi, 1.0)};
  }
  return a;
}

}  // namespace

FormulaEnclosure::FormulaEnclosure(const FormulaTree& tree, Assumptions assumptions)
    : tree_(tree),
      assumptions_(assumptions),
      all_(tree.steps.size()),
      deciders_(tree.steps.size()),
      middle_(tree.steps.size()),
      middle_deciders_(tree.steps.size()) {
  for (std::size_t i = 0; i < tree.steps.size(); ++i) {
    const FormulaStep& step = tree.steps[i];
    if (step.operation == kNumber) {
      Interval number = std::isfinite(step.number) ? Interval{step.number, step.number} : Interval::Nothing();
      if (assumptions.numbers_are_rounded && step.number != std::floor(step.number))
        number = Widened(step.number, step.number);
      all_[i] = {number, {}};
      middle_[i] = number;
    } else if (step.operation == kTime) {
      time_ = static_cast<int>(i);
    } else if (step.of_time_alone) {
      computed_.push_back(static_cast<int>(i));
    }
  }
}

void FormulaEnclosure::Evaluate(double lo, double middle, double hi) {
  EvaluateAt(middle);
  EncloseAll({lo, hi}, Interval{lo, hi} - Interval{middle, middle});
}

bool FormulaEnclosure::IsDecided(FormulaOperation operation, Interval d) {
  if (d.is_empty()) return true;
  if (IsComparison(operation)) return TruthOf(operation, d) != Truth::kPerhaps;
  if (IsRounding(operation) || operation == kSign) return ValueOf(operation, d.lo, 0) == ValueOf(operation, d.hi, 0);
  return d.lo >= 0 || d.hi <= 0;
}

void FormulaEnclosure::EvaluateAt(double t) {
  singular_at_middle_ = false;
  if (time_ >= 0) middle_[static_cast<std::size_t>(time_)] = {t, t};
  for (const int index : computed_) {
    const auto i = static_cast<std::size_t>(index);
    const FormulaStep& step = tree_.steps[i];
    const Interval a = middle_[static_cast<std::size_t>(step.a)];
    const Interval b = middle_[static_cast<std::size_t>(step.b < 0 ? step.a : step.b)];
    if (!IsSwitch(step.operation)) {
      middle_[i] = ValueOfStep(step, a, b);
    } else {
      Interval& decider = middle_deciders_[i];
      if (step.b < 0) {
        decider = a;
      } else if (step.a == step.b) {
        decider = a.is_empty() ? a : Interval{};
      } else {
        decider = a - b;
      }
      middle_[i] = EncloseSwitch(step.operation, {a, {}}, {b, {}}, decider).value;
    }
    singular_at_middle_ = singular_at_middle_ || !middle_[i].is_bounded();
  }
}

void FormulaEnclosure::EncloseAll(Interval t, Interval from_middle) {
  // f(t) is in f(middle) + f'(all of t)(t - middle).
  const auto narrow = [&](Enclosure& enclosure, Interval middle) {
    if (!enclosure.slope.is_bounded() || middle.is_empty() || enclosure.value.is_empty()) return;
    enclosure.value = Meet(enclosure.value, middle + enclosure.slope * from_middle);
  };
  singular_ = false;
  if (time_ >= 0) all_[static_cast<std::size_t>(time_)] = {t, kOne};
  for (const int index : computed_) {
    const auto i = static_cast<std::size_t>(index);
    const FormulaStep& step = tree_.steps[i];
    const Enclosure& a = all_[static_cast<std::size_t>(step.a)];
    const Enclosure& b = all_[static_cast<std::size_t>(step.b < 0 ? step.a : step.b)];
    if (!IsSwitch(step.operation)) {
      const Interval value = ValueOfStep(step, a.value, b.value);
      all_[i] = {value, SlopeOfStep(step, a, b, value)};
      narrow(all_[i], middle_[i]);
    } else {
      Enclosure& decider = deciders_[i];
      if (step.b < 0) {
        decider = a;
      } else if (step.a == step.b) {
        decider = a.value.is_empty() ? a : Enclosure{};
      } else {
        decider = {a.value - b.value, a.slope - b.slope};
        narrow(decider, middle_deciders_[i]);
      }
      all_[i] = EncloseSwitch(step.operation, a, b, decider.value);
    }
    singular_ = singular_ || !all_[i].value.is_bounded();
  }
}

Interval FormulaEnclosure::ValueOfStep(const FormulaStep& step, Interval u, Interval v) const {
  if (assumptions_.has_value) u = InDomain(step.operation, u);
  switch (step.operation) {
    case kNegate:
      return -u;
    case kAdd:
      return u + v;
    case kSubtract:
      return step.a == step.b && u.is_bounded() ? Interval{} : u - v;
    case kMultiply:
      return step.a == step.b ? Square(u) : u * v;
    case kDivide:
      return u / v;
    case kPower:
      if (IsRounding(tree_.steps[static_cast<std::size_t>(step.b)].operation)) return PowerOfWholes(u, v);
      return Power(u, v);
    case kSin:
      return Sine(u);
    case kCos:
      return Cosine(u);
    case kTan:
      return Tangent(u);
    case kAsin:
      return IncreasingWithin<std::asin>(u, -1, 1);
    case kAcos:
      return Interval{std::acos(-1.0) / 2, RoundUp(std::acos(-1.0) / 2)} - IncreasingWithin<std::asin>(u, -1, 1);
    case kAtan:
      return Increasing<std::atan>(u);
    case kSinh:
      return Increasing<std::sinh>(u);
    case kCosh: {
      const double most = std::max(std::abs(u.lo), std::abs(u.hi));
      const double least = u.Contains(0) ? 0 : std::min(std::abs(u.lo), std::abs(u.hi));
      return Increasing<std::cosh>({least, most});
    }
    case kTanh:
      return Increasing<std::tanh>(u);
    case kExp:
      return NotNegative(Increasing<std::exp>(u));
    case kLog:
      return Logarithm(u, std::log);
    case kLog10:
      return Logarithm(u, std::log10);
    case kSqrt:
      return SquareRoot(u);
    default:
      return Interval::Everything();
  }
}

Interval FormulaEnclosure::SlopeOfStep(const FormulaStep& step, const Enclosure& a, const Enclosure& b,
                                       Interval value) {
  const Interval u = a.value, du = a.slope, v = b.value, dv = b.slope;
  switch (step.operation) {
    case kNegate:
      return -du;
    case kAdd:
      return du + dv;
    case kSubtract:
      return step.a == step.b && u.is_bounded() ? Interval{} : du - dv;
    case kMultiply:
      return step.a == step.b ? Interval{2, 2} * u * du : du * v + u * dv;
    case kDivide:
      return (du - value * dv) / v;
    case kPower:
      if (v.is_number() && dv.is_zero()) return v * Power(u, {v.lo - 1, v.lo - 1}) * du;
      return value * (dv * Logarithm(u, std::log) + v * du / u);
    case kSin:
      return Cosine(u) * du;
    case kCos:
      return -Sine(u) * du;
    case kTan:
      return (kOne + Square(value)) * du;
    case kAsin:
      return du / SquareRoot(NotNegative(kOne - Square(u)));
    case kAcos:
      return -(du / SquareRoot(NotNegative(kOne - Square(u))));
    case kAtan:
      return du / (kOne + Square(u));
    case kSinh:
      return Hull(kOne, Increasing<std::cosh>({0, std::max(std::abs(u.lo), std::abs(u.hi))})) * du;
    case kCosh:
      return Increasing<std::sinh>(u) * du;
    case kTanh:
      return NotNegative(kOne - Square(value)) * du;
    case kExp:
      return value * du;
    case kLog:
      return du / u;
    case kLog10:
      return du / (u * Interval{std::log(10.0), RoundUp(std::log(10.0))});
    case kSqrt:
      return du / (Interval{2, 2} * value);
    default:
      return Interval::Everything();
  }
}

}  // namespace dlcs
