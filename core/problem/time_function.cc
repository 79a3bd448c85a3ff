// SPDX-License-Identifier: Apache-2.0
#include "core/problem/time_function.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "core/linalg/abs_times.h"
#include "core/linalg/bounded_sum.h"
#include "core/problem/formula.h"
#include "core/problem/formula_switching.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// An interval of time on which the function is smooth (or sampled): one piece, or one polynomial of it.
struct SmoothInterval {
  double start = 0, end = 0;
  std::size_t piece = 0;
  const TimePiece* function = nullptr;
  std::size_t polynomial = 0;
};

// The smooth intervals of a valid function in order; the first one starts at -∞. A polynomial that starts after the end
// of its piece has none.
std::vector<SmoothInterval> SmoothIntervals(const TimeFunction& function) {
  std::vector<SmoothInterval> stretches;
  for (std::size_t k = 0; k < function.pieces.size(); ++k) {
    const TimePiece& piece = function.pieces[k].function;
    const double begin = k == 0 ? -kInfinity : function.pieces[k].start;
    const double end = k + 1 < function.pieces.size() ? function.pieces[k + 1].start : kInfinity;
    const auto* polynomials = std::get_if<PiecewisePolynomial>(&piece);
    const std::size_t count = polynomials ? polynomials->coefficients.size() : 1;
    for (std::size_t p = 0; p < count; ++p) {
      const double from = p == 0 ? begin : std::max(begin, polynomials->breaks[p]);
      const double to = p + 1 == count ? end : std::min(end, polynomials->breaks[p + 1]);
      if (from < to) stretches.push_back({from, to, k, &piece, p});
    }
  }
  return stretches;
}

// Finds the last of some increasing times that is not after `t`, remembering where it was.
class Finder {
 public:
  explicit Finder(std::vector<double> times) : times_(std::move(times)) {}

  // The last k with times[k] <= t, or times[k] < t from the left; 0 where there is none.
  std::size_t Find(double t, Side side) {
    if (!Holds(last_, t, side)) {
      if (last_ + 1 < times_.size() && Holds(last_ + 1, t, side)) {
        ++last_;
      } else {
        const auto after =
            std::partition_point(times_.begin() + 1, times_.end(), [&](double time) { return Reached(time, t, side); });
        last_ = static_cast<std::size_t>(after - times_.begin()) - 1;
      }
    }
    return last_;
  }

  const std::vector<double>& times() const { return times_; }

 private:
  static bool Reached(double time, double t, Side side) { return side == Side::kRight ? time <= t : time < t; }
  bool Holds(std::size_t k, double t, Side side) const {
    return (k == 0 || Reached(times_[k], t, side)) && (k + 1 == times_.size() || !Reached(times_[k + 1], t, side));
  }

  std::vector<double> times_;
  std::size_t last_ = 0;
};

// A formula on the part of `smooth interval` in [0, horizon]; without a horizon only its values are used.
absl::StatusOr<std::shared_ptr<const AnalyzedFormula>> AnalyzeOn(const std::string& text,
                                                                 const FormulaParameters& parameters,
                                                                 const SmoothInterval& interval, double horizon) {
  return AnalyzeFormula(text, {.parameters = parameters}, std::max(0.0, interval.start),
                        std::min(horizon, interval.end));
}

// The compiled forms of the four kinds of pieces; each writes its value at t to `out`, its derivative, or the bounds
// of their rounding, and knows where it is constant.

constexpr Index kOperations = 4;

class CompiledConstant {
 public:
  explicit CompiledConstant(const ConstantFunction& function) : value_(function.value) {}
  void Evaluate(double /*t*/, Side /*side*/, Eigen::Ref<Vector> out) { out = value_; }
  void RoundingAt(double /*t*/, Eigen::Ref<Vector> out) { out.setZero(); }
  void SlopeAt(double /*t*/, Side /*side*/, Eigen::Ref<Vector> out, Eigen::Ref<Vector> rounding) {
    out.setZero();
    rounding.setZero();
  }
  bool IsSteady(double /*begin*/, double /*end*/) const { return true; }

 private:
  Vector value_;
};

class CompiledFormulas {
 public:
  static absl::StatusOr<CompiledFormulas> Create(const FormulaFunction& function, const SmoothInterval& interval,
                                                 const TimeAxis& axis) {
    CompiledFormulas compiled;
    compiled.constants_ = Vector::Zero(static_cast<Index>(function.formulas.size()));
    std::map<std::string_view, std::size_t> known;  // grids have the same formula at many points
    for (Index i = 0; i < compiled.constants_.size(); ++i) {
      const std::string& text = function.formulas[static_cast<std::size_t>(i)];
      if (const auto found = known.find(text); found != known.end()) {
        compiled.varying_[found->second].components.push_back(i);
        continue;
      }
      auto analyzed = AnalyzeOn(text, function.parameters, interval, axis.horizon);
      if (!analyzed.ok()) return analyzed.status();
      Formula formula(*std::move(analyzed), axis);
      if (formula.DependsOnTime()) {
        known.emplace(text, compiled.varying_.size());
        compiled.varying_.push_back({std::move(formula), {i}});
      } else {
        compiled.constants_(i) = formula.Evaluate(0);
      }
    }
    return compiled;
  }

  void Evaluate(double t, Side side, Eigen::Ref<Vector> out) {
    out = constants_;
    for (Varying& varying : varying_) {
      const double value = varying.formula.Evaluate(t, side);
      for (const Index i : varying.components) out(i) = value;
    }
  }

  void RoundingAt(double t, Eigen::Ref<Vector> out) {
    out.setZero();
    for (Varying& varying : varying_) {
      const double rounding = varying.formula.RoundingAt(t);
      for (const Index i : varying.components) out(i) = rounding;
    }
  }

  void SlopeAt(double t, Side side, Eigen::Ref<Vector> out, Eigen::Ref<Vector> rounding) {
    out.setZero();
    rounding.setZero();
    for (Varying& varying : varying_) {
      const Formula::Slope slope = varying.formula.SlopeAt(t, side);
      for (const Index i : varying.components) {
        out(i) = slope.value;
        rounding(i) = slope.rounding;
      }
    }
  }

  bool IsSteady(double begin, double end) {
    return std::all_of(varying_.begin(), varying_.end(),
                       [&](Varying& varying) { return varying.formula.IsSteady(begin, end); });
  }

 private:
  struct Varying {
    Formula formula;
    std::vector<Index> components;
  };
  Vector constants_;  // of the components whose formula is one number; 0 elsewhere
  std::vector<Varying> varying_;
};

class CompiledSamples {
 public:
  explicit CompiledSamples(const SampledFunction& function) : finder_(function.times), values_(function.values) {}

  void Evaluate(double t, Side /*side*/, Eigen::Ref<Vector> out) {
    const std::size_t k = finder_.Find(t, Side::kRight);
    const std::vector<double>& times = finder_.times();
    const auto column = static_cast<Index>(k);
    if (t <= times.front() || k + 1 == times.size()) {
      out = values_.col(column);
    } else {
      // Exact at both ends.
      const double s = (t - times[k]) / (times[k + 1] - times[k]);
      out = (1 - s) * values_.col(column) + s * values_.col(column + 1);
    }
  }

  void RoundingAt(double t, Eigen::Ref<Vector> out) {
    const auto column = static_cast<Index>(finder_.Find(t, Side::kRight));
    const Index next = std::min(column + 1, values_.cols() - 1);
    out = RoundingOf(kOperations) * values_.col(column).cwiseAbs().cwiseMax(values_.col(next).cwiseAbs());
  }

  void SlopeAt(double t, Side side, Eigen::Ref<Vector> out, Eigen::Ref<Vector> rounding) {
    const std::size_t k = finder_.Find(t, side);
    const std::vector<double>& times = finder_.times();
    const auto column = static_cast<Index>(k);
    out.setZero();
    rounding.setZero();
    if (t <= times.front() || k + 1 == times.size()) return;
    const double length = times[k + 1] - times[k];
    out = (values_.col(column + 1) - values_.col(column)) / length;
    rounding = RoundingOf(kOperations) / length * (values_.col(column + 1).cwiseAbs() + values_.col(column).cwiseAbs());
  }

  bool IsSteady(double /*begin*/, double /*end*/) const { return false; }

 private:
  Finder finder_;
  Matrix values_;
};

class CompiledPolynomial {
 public:
  CompiledPolynomial(double origin, const Matrix& coefficients) : origin_(origin), coefficients_(coefficients) {}

  void Evaluate(double t, Side /*side*/, Eigen::Ref<Vector> out) {
    const double s = t - origin_;
    Index k = coefficients_.cols() - 1;
    out = coefficients_.col(k);
    while (k-- > 0) out = out * s + coefficients_.col(k);
  }

  void RoundingAt(double t, Eigen::Ref<Vector> out) {
    const double s = std::abs(t - origin_);
    Index k = coefficients_.cols() - 1;
    out = coefficients_.col(k).cwiseAbs();
    while (k-- > 0) out = out * s + coefficients_.col(k).cwiseAbs();
    out *= RoundingOf(kOperations) * static_cast<double>(coefficients_.cols());
  }

  void SlopeAt(double t, Side /*side*/, Eigen::Ref<Vector> out, Eigen::Ref<Vector> rounding) {
    const double s = t - origin_;
    out.setZero();
    rounding.setZero();
    for (Index k = coefficients_.cols() - 1; k > 0; --k) {
      const auto of_slope = static_cast<double>(k) * coefficients_.col(k);
      out = out * s + of_slope;
      rounding = rounding * std::abs(s) + of_slope.cwiseAbs();
    }
    rounding *= RoundingOf(kOperations) * static_cast<double>(coefficients_.cols());
  }

  bool IsSteady(double /*begin*/, double /*end*/) const { return coefficients_.cols() == 1; }

 private:
  double origin_;
  Matrix coefficients_;
};

using CompiledPiece = std::variant<CompiledConstant, CompiledFormulas, CompiledSamples, CompiledPolynomial>;

absl::StatusOr<CompiledPiece> Compile(const SmoothInterval& interval, const TimeAxis& axis) {
  if (const auto* constant = std::get_if<ConstantFunction>(interval.function)) return CompiledConstant(*constant);
  if (const auto* samples = std::get_if<SampledFunction>(interval.function)) return CompiledSamples(*samples);
  if (const auto* polynomials = std::get_if<PiecewisePolynomial>(interval.function)) {
    const std::size_t p = interval.polynomial;
    return CompiledPolynomial(polynomials->breaks[p], polynomials->coefficients[p]);
  }
  return CompiledFormulas::Create(std::get<FormulaFunction>(*interval.function), interval, axis);
}

TimeFunction OnePiece(TimePiece piece) {
  TimeFunction function;
  function.pieces.push_back({0, std::move(piece)});
  return function;
}

}  // namespace

TimeFunction TimeFunction::Constant(Vector value) { return OnePiece(ConstantFunction{std::move(value)}); }

TimeFunction TimeFunction::Zero(Index size) { return Constant(Vector::Zero(size)); }

TimeFunction TimeFunction::Formulas(std::vector<std::string> formulas) {
  return OnePiece(FormulaFunction{std::move(formulas)});
}

TimeFunction TimeFunction::Sampled(std::vector<double> times, Matrix values) {
  return OnePiece(SampledFunction{std::move(times), std::move(values)});
}

struct TimeFunctionEvaluator::Impl {
  Index size;
  Finder starts;
  std::vector<CompiledPiece> pieces;
  StructuredMatrix lift;
  Matrix inner, inner_rounding;  // one column, where there is a lift

  void EvaluatePieces(double t, Side side, Eigen::Ref<Vector> out) {
    CompiledPiece& piece = pieces[starts.Find(t, side)];
    std::visit([&](auto& compiled) { compiled.Evaluate(t, side, out); }, piece);
  }

  void SlopeOfPieces(double t, Side side, Eigen::Ref<Vector> out, Eigen::Ref<Vector> rounding) {
    CompiledPiece& piece = pieces[starts.Find(t, side)];
    std::visit([&](auto& compiled) { compiled.SlopeAt(t, side, out, rounding); }, piece);
  }

  void RoundingOfPieces(double t, Eigen::Ref<Vector> out) {
    CompiledPiece& piece = pieces[starts.Find(t, Side::kRight)];
    std::visit([&](auto& compiled) { compiled.RoundingAt(t, out); }, piece);
  }
};

absl::StatusOr<TimeFunctionEvaluator> TimeFunctionEvaluator::Create(const TimeFunction& function, Index size,
                                                                    const TimeAxis& axis) {
  const std::vector<Violation> violations = Validate(function, size, "function");
  if (!violations.empty()) {
    return StatusOf({violations.front()});
  }
  std::vector<double> starts;
  std::vector<CompiledPiece> pieces;
  for (const SmoothInterval& interval : SmoothIntervals(function)) {
    absl::StatusOr<CompiledPiece> piece = Compile(interval, axis);
    if (!piece.ok()) return piece.status();
    starts.push_back(axis.Nearest(interval.start));
    pieces.push_back(std::move(*piece));
  }
  return TimeFunctionEvaluator(std::make_unique<Impl>(
      Impl{size, Finder(std::move(starts)), std::move(pieces), function.lift, Matrix(function.lift.cols(), 1), {}}));
}

TimeFunctionEvaluator::TimeFunctionEvaluator(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TimeFunctionEvaluator::TimeFunctionEvaluator(TimeFunctionEvaluator&&) noexcept = default;
TimeFunctionEvaluator& TimeFunctionEvaluator::operator=(TimeFunctionEvaluator&&) noexcept = default;
TimeFunctionEvaluator::~TimeFunctionEvaluator() = default;

Index TimeFunctionEvaluator::size() const { return impl_->size; }

void TimeFunctionEvaluator::Evaluate(double t, Side side, Eigen::Ref<Vector> out) {
  if (impl_->lift.size() == 0) return impl_->EvaluatePieces(t, side, out);
  impl_->EvaluatePieces(t, side, impl_->inner.col(0));
  impl_->lift.Multiply(impl_->inner, out);
}

bool TimeFunctionEvaluator::IsSteady(double begin, double end) {
  CompiledPiece& piece = impl_->pieces[impl_->starts.Find(end, Side::kLeft)];
  if (&piece != &impl_->pieces[impl_->starts.Find(begin, Side::kRight)]) return false;
  return std::visit([&](auto& compiled) { return compiled.IsSteady(begin, end); }, piece);
}

void TimeFunctionEvaluator::RoundingAt(double t, Eigen::Ref<Vector> out) {
  if (impl_->lift.size() == 0) return impl_->RoundingOfPieces(t, out);
  Matrix& rounding = impl_->inner_rounding;
  rounding.resize(impl_->inner.rows(), 1);
  impl_->RoundingOfPieces(t, rounding.col(0));
  impl_->EvaluatePieces(t, Side::kRight, impl_->inner.col(0));
  rounding += RoundingOf(kOperations) * impl_->inner.cwiseAbs();
  out = AbsTimes(impl_->lift.Dense(), rounding.col(0));
}

void TimeFunctionEvaluator::SlopeAt(double t, Side side, Eigen::Ref<Vector> out, Eigen::Ref<Vector> rounding) {
  if (impl_->lift.size() == 0) return impl_->SlopeOfPieces(t, side, out, rounding);
  Matrix& of_inner = impl_->inner_rounding;
  of_inner.resize(impl_->inner.rows(), 1);
  impl_->SlopeOfPieces(t, side, impl_->inner.col(0), of_inner.col(0));
  impl_->lift.Multiply(impl_->inner, out);
  of_inner += RoundingOf(kOperations) * impl_->inner.cwiseAbs();
  rounding = AbsTimes(impl_->lift.Dense(), of_inner.col(0));
}

std::vector<AnalyzedComponent> AnalyzeFormulas(const TimeFunction& function, double horizon) {
  constexpr int kMaxRefused = 8;  // each of them may have taken a second
  int refused = 0;
  std::vector<AnalyzedComponent> analyzed;
  for (const SmoothInterval& interval : SmoothIntervals(function)) {
    const auto* formulas = std::get_if<FormulaFunction>(interval.function);
    if (!formulas) continue;
    std::set<std::string_view> known;
    for (std::size_t i = 0; i < formulas->formulas.size(); ++i) {
      if (!known.insert(formulas->formulas[i]).second) continue;
      auto formula = AnalyzeOn(formulas->formulas[i], formulas->parameters, interval, horizon);
      if (!formula.ok()) continue;
      analyzed.push_back({interval.piece, static_cast<Index>(i), *std::move(formula)});
      refused += !analyzed.back().formula->switching.refusal.empty();
      if (refused == kMaxRefused) return analyzed;
    }
  }
  return analyzed;
}

std::vector<UncertainTime> UncertainBreakPoints(const TimeFunction& function, double horizon) {
  std::vector<UncertainTime> uncertain;
  for (const AnalyzedComponent& component : AnalyzeFormulas(function, horizon)) {
    const FormulaSwitching& switching = component.formula->switching;
    for (std::size_t k = 0; k < switching.times.size(); ++k) {
      const UncertainTime time{switching.times[k], switching.time_errors[k]};
      if (time.error > kSameTime * time.time) uncertain.push_back(time);
    }
  }
  std::sort(uncertain.begin(), uncertain.end(),
            [](const UncertainTime& a, const UncertainTime& b) { return a.time < b.time; });
  return uncertain;
}

std::vector<double> BreakPoints(const TimeFunction& function, double horizon) {
  std::vector<double> points;
  for (const SmoothInterval& interval : SmoothIntervals(function)) {
    if (interval.start > 0 && interval.start < horizon) points.push_back(interval.start);
  }
  for (const AnalyzedComponent& component : AnalyzeFormulas(function, horizon)) {
    const std::vector<double>& times = component.formula->switching.times;
    points.insert(points.end(), times.begin(), times.end());
  }
  if (!std::is_sorted(points.begin(), points.end())) std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

}  // namespace dlcs
