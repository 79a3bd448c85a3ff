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

}  // namespace

FormulaEnclosure::FormulaEnclosure(const FormulaTree& tree, bool numbers_are_rounded)
    : tree_(tree),
      all_(tree.steps.size()),
      middle_(tree.steps.size()),
      deciders_(tree.steps.size()),
      middle_deciders_(tree.steps.size()) {
  for (std::size_t i = 0; i < tree.steps.size(); ++i) {
    const FormulaStep& step = tree.steps[i];
    if (step.operation == kNumber) {
      Interval number = std::isfinite(step.number) ? Interval{step.number, step.number} : Interval::Nothing();
      if (numbers_are_rounded && step.number != std::floor(step.number)) number = Widened(step.number, step.number);
      all_[i] = middle_[i] = {number, {}};
    } else if (step.operation == kTime) {
      time_ = static_cast<int>(i);
    } else if (step.of_time_alone) {
      computed_.push_back(static_cast<int>(i));
    }
  }
}

void FormulaEnclosure::Evaluate(double lo, double middle, double hi) {
  middle_time_ = middle;
  EncloseAll({middle, middle}, true);
  EncloseAll({lo, hi}, false);
}

bool FormulaEnclosure::IsDecided(FormulaOperation operation, Interval d) {
  if (d.is_empty()) return true;
  if (IsComparison(operation)) return TruthOf(operation, d) != Truth::kPerhaps;
  if (IsRounding(operation) || operation == kSign) return ValueOf(operation, d.lo, 0) == ValueOf(operation, d.hi, 0);
  return d.lo >= 0 || d.hi <= 0;
}

void FormulaEnclosure::EncloseAll(Interval t, bool at_middle) {
  std::vector<Enclosure>& known = at_middle ? middle_ : all_;
  std::vector<Enclosure>& deciders = at_middle ? middle_deciders_ : deciders_;
  const Interval from_middle = t - Interval{middle_time_, middle_time_};
  // f(t) is in f(middle) + f'(all of t)(t - middle).
  const auto narrow = [&](Enclosure& enclosure, Interval middle) {
    if (at_middle || !enclosure.slope.is_bounded() || middle.is_empty() || enclosure.value.is_empty()) return;
    enclosure.value = Meet(enclosure.value, middle + enclosure.slope * from_middle);
  };
  bool singular = false;
  if (time_ >= 0) known[static_cast<std::size_t>(time_)] = {t, kOne};
  for (const int index : computed_) {
    const auto i = static_cast<std::size_t>(index);
    const FormulaStep& step = tree_.steps[i];
    if (!IsSwitch(step.operation)) {
      known[i] = EncloseStep(step, known);
      narrow(known[i], middle_[i].value);
    } else {
      const Enclosure& a = known[static_cast<std::size_t>(step.a)];
      const Enclosure& b = known[static_cast<std::size_t>(step.b < 0 ? step.a : step.b)];
      Enclosure& decider = deciders[i];
      if (step.b < 0) {
        decider = a;
      } else if (step.a == step.b) {
        decider = a.value.is_empty() ? a : Enclosure{};
      } else {
        decider = {a.value - b.value, a.slope - b.slope};
        narrow(decider, middle_deciders_[i].value);
      }
      known[i] = EncloseSwitch(step.operation, a, b, decider.value);
    }
    singular = singular || !known[i].value.is_bounded();
  }
  (at_middle ? singular_at_middle_ : singular_) = singular;
}

Enclosure FormulaEnclosure::EncloseStep(const FormulaStep& step, const std::vector<Enclosure>& known) const {
  const Enclosure& a = known[static_cast<std::size_t>(step.a)];
  const Enclosure& b = known[static_cast<std::size_t>(step.b < 0 ? step.a : step.b)];
  const Interval u = a.value, du = a.slope, v = b.value, dv = b.slope;
  switch (step.operation) {
    case kNegate:
      return {-u, -du};
    case kAdd:
      return {u + v, du + dv};
    case kSubtract:
      return step.a == step.b && u.is_bounded() ? Enclosure{} : Enclosure{u - v, du - dv};
    case kMultiply:
      return step.a == step.b ? Enclosure{Square(u), Interval{2, 2} * u * du} : Enclosure{u * v, du * v + u * dv};
    case kDivide: {
      const Interval quotient = u / v;
      return {quotient, (du - quotient * dv) / v};
    }
    case kPower: {
      const Interval power = Power(u, v);
      if (v.is_number() && dv.is_zero()) return {power, v * Power(u, {v.lo - 1, v.lo - 1}) * du};
      return {power, power * (dv * Logarithm(u, std::log) + v * du / u)};
    }
    case kSin:
      return {Sine(u), Cosine(u) * du};
    case kCos:
      return {Cosine(u), -Sine(u) * du};
    case kTan: {
      const Interval tangent = Tangent(u);
      return {tangent, (kOne + Square(tangent)) * du};
    }
    case kAsin:
      return {IncreasingWithin<std::asin>(u, -1, 1), du / SquareRoot(NotNegative(kOne - Square(u)))};
    case kAcos:
      return {Interval{std::acos(-1.0) / 2, RoundUp(std::acos(-1.0) / 2)} - IncreasingWithin<std::asin>(u, -1, 1),
              -(du / SquareRoot(NotNegative(kOne - Square(u))))};
    case kAtan:
      return {Increasing<std::atan>(u), du / (kOne + Square(u))};
    case kSinh:
      return {Increasing<std::sinh>(u),
              Hull(kOne, Increasing<std::cosh>({0, std::max(std::abs(u.lo), std::abs(u.hi))})) * du};
    case kCosh: {
      const double most = std::max(std::abs(u.lo), std::abs(u.hi));
      const double least = u.Contains(0) ? 0 : std::min(std::abs(u.lo), std::abs(u.hi));
      return {Increasing<std::cosh>({least, most}), Increasing<std::sinh>(u) * du};
    }
    case kTanh: {
      const Interval tangent = Increasing<std::tanh>(u);
      return {tangent, NotNegative(kOne - Square(tangent)) * du};
    }
    case kExp: {
      const Interval value = NotNegative(Increasing<std::exp>(u));
      return {value, value * du};
    }
    case kLog:
      return {Logarithm(u, std::log), du / u};
    case kLog10:
      return {Logarithm(u, std::log10), du / (u * Interval{std::log(10.0), RoundUp(std::log(10.0))})};
    case kSqrt: {
      const Interval root = SquareRoot(u);
      return {root, du / (Interval{2, 2} * root)};
    }
    default:
      return {Interval::Everything(), Interval::Everything()};
  }
}

}  // namespace dlcs
