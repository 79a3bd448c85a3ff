// SPDX-License-Identifier: Apache-2.0
#include "core/problem/source_periods.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "core/format_number.h"
#include "core/linalg/weyl_sequence.h"
#include "core/problem/formula_lexer.h"
#include "core/problem/formula_syntax.h"
#include "core/problem/time_function.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

// Two periods whose ratio is a fraction up to this part of it have a common multiple.
constexpr double kSameRatio = 1e-9;
constexpr Index kMaxDenominator = 10'000;
// Values one period apart are equal up to this part of the largest value.
constexpr double kSameValue = 1e-8;

// slope · t + a function with this period (0: a constant), from some time on.
struct Growth {
  double slope = 0;
  double period = 0;
};

// The least common multiple; 0 stands for any period.
std::optional<double> CommonPeriod(double a, double b) {
  if (a == 0 || b == 0) return std::max(a, b);
  // The convergents p/q of a/b as a continued fraction: q periods a are p periods b.
  const double ratio = a / b;
  double p_before = 1, q_before = 0, p = std::floor(ratio), q = 1, rest = ratio - p;
  while (q <= kMaxDenominator) {
    if (p > 0 && std::abs(ratio - p / q) <= kSameRatio * ratio) return a * q;
    if (rest == 0) break;
    const double whole = std::floor(1 / rest);
    rest = 1 / rest - whole;
    p_before = std::exchange(p, whole * p + p_before);
    q_before = std::exchange(q, whole * q + q_before);
  }
  return std::nullopt;
}

using MaybeGrowth = std::optional<Growth>;

// A function of `a` and `b`, which do not grow.
MaybeGrowth OfBounded(const Growth& a, const Growth& b = {}) {
  if (a.slope != 0 || b.slope != 0) return std::nullopt;
  const std::optional<double> period = CommonPeriod(a.period, b.period);
  return period ? MaybeGrowth{{0, *period}} : std::nullopt;
}

MaybeGrowth Sum(const Growth& a, const Growth& b, double sign) {
  constexpr double kCancels = 1e-12;
  const std::optional<double> period = CommonPeriod(a.period, b.period);
  if (!period) return std::nullopt;
  double slope = a.slope + sign * b.slope;
  if (std::abs(slope) <= kCancels * (std::abs(a.slope) + std::abs(b.slope))) slope = 0;
  return Growth{slope, *period};
}

// A function of `a` that repeats when `a` grows by `span`.
MaybeGrowth OfAngle(const Growth& a, double span, double slope) {
  if (a.slope == 0) return Growth{0, a.period};
  const std::optional<double> period = CommonPeriod(span / std::abs(a.slope), a.period);
  return period ? MaybeGrowth{{slope, *period}} : std::nullopt;
}

MaybeGrowth GrowthOf(const FormulaStep& step, const FormulaTree& tree, const std::vector<MaybeGrowth>& known) {
  using enum FormulaOperation;
  if (step.operation == kNumber) return Growth{};
  if (step.operation == kTime) return Growth{1, 0};
  if (step.a < 0) return std::nullopt;
  const auto at = [](int operand) { return static_cast<std::size_t>(operand); };
  if (!known[at(step.a)] || (step.b >= 0 && !known[at(step.b)])) return std::nullopt;
  const Growth a = *known[at(step.a)], b = step.b >= 0 ? *known[at(step.b)] : Growth{};
  const auto number = [&](int operand) -> std::optional<double> {
    const FormulaStep& of = tree.steps[at(operand)];
    return of.operation == kNumber ? std::optional<double>(of.number) : std::nullopt;
  };
  switch (step.operation) {
    case kNegate:
      return Growth{-a.slope, a.period};
    case kAdd:
      return Sum(a, b, 1);
    case kSubtract:
      return Sum(a, b, -1);
    case kMultiply:
      if (const auto factor = number(step.a)) return Growth{*factor * b.slope, *factor == 0 ? 0 : b.period};
      if (const auto factor = number(step.b)) return Growth{*factor * a.slope, *factor == 0 ? 0 : a.period};
      return OfBounded(a, b);
    case kDivide:
      if (const auto divisor = number(step.b)) return Growth{a.slope / *divisor, a.period};
      return OfBounded(a, b);
    case kSin:
    case kCos:
      return OfAngle(a, 2 * std::numbers::pi, 0);
    case kTan:
      return OfAngle(a, std::numbers::pi, 0);
    case kFloor:
    case kCeil:
      return OfAngle(a, 1, a.slope);
    case kMin:
    case kMax:
      // From some time on it is the one that grows more, or less.
      if (a.slope != b.slope) return (a.slope > b.slope) == (step.operation == kMax) ? a : b;
      return Sum(a, {0, b.period}, 1);
    default:
      break;
  }
  if (IsComparison(step.operation)) {
    // Decided for ever from some time on.
    if (a.slope != b.slope) return Growth{};
    return Sum({0, a.period}, {0, b.period}, 1);
  }
  return OfBounded(a, b);
}

bool IsMultiple(double period, double of) {
  const double ratio = period / of, whole = std::round(ratio);
  return whole >= 1 && std::abs(ratio - whole) <= kSameValue * ratio;
}

// A source of the problem, with what the check of its period needs.
struct PeriodicSource {
  const TimeFunction& function;
  Index size;
  std::string name;  // "f", "g"
};

// Whether the function is known up to T alone.
bool IsData(const TimeFunction& function) {
  if (function.pieces.size() > 1) return true;
  const TimePiece& piece = function.pieces.front().function;
  return std::holds_alternative<SampledFunction>(piece) || std::holds_alternative<PiecewisePolynomial>(piece);
}

bool IsSame(double a, double b) { return std::abs(a - b) <= kSameRatio * std::abs(b); }

// Offsets in (0, period) at which to compare: in every interval between two break points of the function in
// [begin, begin + 2 periods], and at irregular times.
std::vector<double> OffsetsToCompare(const TimeFunction& function, double begin, double period) {
  constexpr int kIrregular = 67;
  constexpr std::array<double, 3> kInside = {0.2113, 0.5, 0.7887};
  std::vector<double> breaks = {0, period};
  for (const double time : BreakPoints(function, begin + 2 * period)) {
    if (time > begin) breaks.push_back(time - begin < period ? time - begin : time - begin - period);
  }
  for (int k = 1; k <= kIrregular; ++k) breaks.push_back(period * WeylValue(k));
  std::sort(breaks.begin(), breaks.end());
  std::vector<double> offsets;
  for (std::size_t k = 0; k + 1 < breaks.size(); ++k) {
    const double length = breaks[k + 1] - breaks[k];
    if (length < kSameRatio * period) continue;
    for (const double part : kInside) offsets.push_back(breaks[k] + part * length);
  }
  return offsets;
}

// The component of `source` that differs most from itself one period later, and where; absent where all repeat.
struct Mismatch {
  Index component;
  double time, value, later;
};
std::vector<Mismatch> MismatchesOf(const PeriodicSource& source, double begin, double period) {
  auto evaluator = TimeFunctionEvaluator::Create(source.function, source.size);
  if (!evaluator.ok()) return {};
  Vector now(source.size), later(source.size), size = Vector::Zero(source.size), worst = size;
  std::vector<Mismatch> at(static_cast<std::size_t>(source.size));
  for (const double offset : OffsetsToCompare(source.function, begin, period)) {
    const double time = begin + offset;
    evaluator->Evaluate(time, Side::kRight, now);
    evaluator->Evaluate(time + period, Side::kRight, later);
    for (Index i = 0; i < source.size; ++i) {
      size[i] = std::max({size[i], std::abs(now[i]), std::abs(later[i])});
      const double difference = std::abs(later[i] - now[i]);
      if (difference <= worst[i]) continue;
      worst[i] = difference;
      at[static_cast<std::size_t>(i)] = {i, time, now[i], later[i]};
    }
  }
  std::vector<Mismatch> mismatches;
  for (Index i = 0; i < source.size; ++i) {
    if (worst[i] > kSameValue * size[i]) mismatches.push_back(at[static_cast<std::size_t>(i)]);
  }
  return mismatches;
}

std::array<PeriodicSource, 2> PeriodicSources(const Problem& problem) {
  return {{{problem.f, problem.num_states(), "f"}, {problem.g, problem.num_constraints(), "g"}}};
}

// One period of data, which repeats by definition.
bool IsOnePeriod(const Problem& problem, const PeriodicSource& source, double period) {
  return IsData(source.function) && IsSame(problem.horizon, period);
}

// Delays are at most some periods; what decays is periodic after many.
constexpr std::array<int, 12> kStarts = {0, 1, 2, 3, 4, 6, 8, 12, 16, 32, 64, 128};

// Whether all sources repeat from `begin` on, as far as they are known.
bool Repeat(const Problem& problem, double begin, double period) {
  for (const PeriodicSource& source : PeriodicSources(problem)) {
    if (IsOnePeriod(problem, source, period)) {
      if (begin > 0) return false;
      continue;
    }
    const bool is_known = begin + 2 * period <= problem.horizon * (1 + kSameRatio);
    if (IsData(source.function) && !is_known) return false;
    if (!MismatchesOf(source, begin, period).empty()) return false;
  }
  return true;
}

// The number of periods in [0, T] after which no break point makes a source differ from itself one period later. It may
// have a jump between the starts above.
double PeriodsBeforeLastBreak(const Problem& problem, double period) {
  double periods = 0;
  for (const PeriodicSource& source : PeriodicSources(problem)) {
    auto evaluator = TimeFunctionEvaluator::Create(source.function, source.size);
    if (IsOnePeriod(problem, source, period) || !evaluator.ok()) continue;
    const double last = problem.horizon - period;  // to be compared with T
    std::vector<double> breaks;
    for (const double time : BreakPoints(source.function, problem.horizon)) {
      for (const double at : {time - period, time}) {
        if (at > 0 && at < last) breaks.push_back(at);
      }
    }
    if (breaks.empty()) continue;
    breaks.insert(breaks.end(), {0, last});
    std::sort(breaks.begin(), breaks.end());
    const Index count = static_cast<Index>(breaks.size()) - 1;
    Matrix difference(source.size, count);
    Vector now(source.size), later(source.size), size = Vector::Zero(source.size);
    for (Index k = 0; k < count; ++k) {
      const double begin = breaks[static_cast<std::size_t>(k)], end = breaks[static_cast<std::size_t>(k) + 1];
      difference.col(k).setZero();
      if (end - begin < kSameRatio * period) continue;
      const double time = begin + (end - begin) / 2;
      evaluator->Evaluate(time, Side::kRight, now);
      evaluator->Evaluate(time + period, Side::kRight, later);
      size = size.cwiseMax(now.cwiseAbs()).cwiseMax(later.cwiseAbs());
      difference.col(k) = (later - now).cwiseAbs();
    }
    for (Index k = 0; k < count; ++k) {
      if ((difference.col(k).array() <= kSameValue * size.array()).all()) continue;
      const double ends = breaks[static_cast<std::size_t>(k) + 1] / period;
      periods = std::max(periods, std::ceil(ends * (1 - kSameRatio)));
    }
  }
  return periods;
}

std::optional<double> StartOfRepeating(const Problem& problem, double period) {
  const double least = PeriodsBeforeLastBreak(problem, period);
  if (least > 0 && Repeat(problem, least * period, period)) return least * period;
  for (const int start : kStarts) {
    if (start >= least && Repeat(problem, start * period, period)) return start * period;
  }
  return std::nullopt;
}

// The period of a formula in the component that `period` is no multiple of, if the function is one piece of formulas.
std::optional<double> MissedPeriod(const TimeFunction& function, Index component, double period) {
  if (function.pieces.size() != 1) return std::nullopt;
  const auto* formulas = std::get_if<FormulaFunction>(&function.pieces.front().function);
  if (!formulas) return std::nullopt;
  for (std::size_t k = 0; k < formulas->formulas.size(); ++k) {
    const auto inner = static_cast<Index>(k);
    const bool occurs = function.is_lifted() ? function.lift.Dense()(component, inner) != 0 : inner == component;
    if (!occurs) continue;
    const auto tree = ReadFormula(formulas->formulas[k], {.parameters = formulas->parameters});
    const std::optional<double> own = tree.ok() ? PeriodOf(*tree) : std::nullopt;
    if (own && *own > 0 && !IsMultiple(period, *own)) return own;
  }
  return std::nullopt;
}

void DescribeMismatch(const PeriodicSource& source, const Mismatch& mismatch, double period, ViolationList& list) {
  const std::string name = source.name + "[" + std::to_string(mismatch.component) + "]";
  const std::string value = NumberText(period);
  if (const auto own = MissedPeriod(source.function, mismatch.component, period)) {
    list.Add("period", value + "; must be a multiple of the period of every source, and that of " + name + " is " +
                           NumberText(*own));
    return;
  }
  list.Add("period", value + "; must be a period of every source, and " + name + " is " + FormatNumber(mismatch.value) +
                         " at t = " + FormatNumber(mismatch.time) + " and " + FormatNumber(mismatch.later) +
                         " one period later");
}

void CheckSources(const Problem& problem, double period, ViolationList& list) {
  if (StartOfRepeating(problem, period)) return;
  const int last = kStarts.back();
  for (const PeriodicSource& source : PeriodicSources(problem)) {
    if (IsOnePeriod(problem, source, period)) continue;
    double begin = last * period;
    if (IsData(source.function)) {
      const double periods = std::floor(problem.horizon * (1 + kSameRatio) / period);
      if (periods < 2) {
        list.Add("period", NumberText(period) + "; " + source.name +
                               " is given by samples or pieces up to T = " + NumberText(problem.horizon) +
                               ": T must be the period, and then they are one period, or at least two periods");
        continue;
      }
      begin = (std::min<double>(periods, last) - 2) * period;
    }
    for (const Mismatch& mismatch : MismatchesOf(source, begin, period)) {
      DescribeMismatch(source, mismatch, period, list);
    }
  }
  if (list.empty()) {
    list.Add("period", NumberText(period) + "; f and g must repeat with it from one time on, and do not");
  }
}

// The first component of a source that depends on time, as "f[1]".
std::optional<std::string> DependsOnTime(const Problem& problem) {
  for (const PeriodicSource& source : PeriodicSources(problem)) {
    auto evaluator = TimeFunctionEvaluator::Create(source.function, source.size);
    if (!evaluator.ok()) continue;
    Vector first(source.size), value(source.size);
    evaluator->Evaluate(0, Side::kRight, first);
    for (const double offset : OffsetsToCompare(source.function, 0, problem.horizon)) {
      evaluator->Evaluate(offset, Side::kRight, value);
      for (Index i = 0; i < source.size; ++i) {
        if (value[i] != first[i]) return source.name + "[" + std::to_string(i) + "]";
      }
    }
  }
  return std::nullopt;
}

// The formula at t + phase.
std::string Shifted(std::string_view text, double phase) {
  std::string shifted;
  std::size_t begin = 0;
  for (FormulaToken token = NextFormulaToken(text, 0); token.kind != FormulaToken::Kind::kEnd;
       token = NextFormulaToken(text, begin)) {
    shifted += text.substr(begin, token.position - begin);
    const bool is_time = token.kind == FormulaToken::Kind::kName && token.text == "t";
    shifted += is_time ? "(t + " + NumberText(phase) + ")" : std::string(token.text);
    begin = token.position + token.text.size();
  }
  return shifted;
}

TimeFunction Shifted(TimeFunction function, double phase) {
  for (TimeFunction::Piece& piece : function.pieces) {
    piece.start -= phase;
    if (auto* samples = std::get_if<SampledFunction>(&piece.function)) {
      for (double& time : samples->times) time -= phase;
    } else if (auto* polynomials = std::get_if<PiecewisePolynomial>(&piece.function)) {
      for (double& time : polynomials->breaks) time -= phase;
    } else if (auto* formulas = std::get_if<FormulaFunction>(&piece.function)) {
      for (std::string& text : formulas->formulas) text = Shifted(text, phase);
    }
  }
  // The first piece holds before its start too.
  const auto after = std::find_if(function.pieces.begin(), function.pieces.end(),
                                  [](const TimeFunction::Piece& piece) { return piece.start > 0; });
  if (after - function.pieces.begin() > 1) function.pieces.erase(function.pieces.begin(), std::prev(after));
  return function;
}

}  // namespace

std::optional<double> PeriodOf(const FormulaTree& tree) {
  std::vector<MaybeGrowth> known;
  known.reserve(tree.steps.size());
  for (const FormulaStep& step : tree.steps) known.push_back(GrowthOf(step, tree, known));
  if (known.empty() || !known.back() || known.back()->slope != 0) return std::nullopt;
  return known.back()->period;
}

std::vector<Violation> CheckPeriod(const Problem& problem, const Options& options) {
  ViolationList list;
  if (options.period == Options::kFindPeriod) {
    if (const auto source = DependsOnTime(problem)) {
      list.Add("period",
               "to be found, but " + *source + " depends on time; give the period, a multiple of that of every source");
    }
  } else if (options.period > 0 && std::isfinite(options.period)) {
    CheckSources(problem, options.period, list);
  }
  return std::move(list).Take();
}

OnePeriod ProblemOfOnePeriod(const Problem& problem, double period) {
  OnePeriod one{problem, StartOfRepeating(problem, period).value_or(0)};
  Problem& of_period = one.problem;
  of_period.horizon = period;
  if (one.phase > 0) {
    of_period.f = Shifted(problem.f, one.phase);
    of_period.g = Shifted(problem.g, one.phase);
    of_period.outputs.h = Shifted(problem.outputs.h, one.phase);
  }
  of_period.break_points.clear();
  for (const double time : problem.break_points) {
    const double inside = time - one.phase;
    if (inside > 0 && inside < period) of_period.break_points.push_back(inside);
  }
  return one;
}

}  // namespace dlcs
