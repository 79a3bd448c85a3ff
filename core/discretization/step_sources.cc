// SPDX-License-Identifier: Apache-2.0

#include "core/discretization/step_sources.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

#include "core/format_number.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"
#include "core/linalg/weyl_sequence.h"

namespace dlcs {
namespace {

// Not a node, and not symmetric to one: between the two nodes right of the middle.
constexpr double kCheckPosition = 0.1305;
// Of an interpolant, on its largest value; a difference that is no more than their rounding is no interpolation error.
constexpr Index kOperations = 64;

// What is left of the size of each value beyond `rounding`.
Vector Beyond(const Vector& values, const Vector& rounding) {
  return values.binaryExpr(rounding,
                           [](double value, double of_rounding) { return NanMax(0, std::abs(value) - of_rounding); });
}

// The time of a node on [begin, end].
double TimeOfNode(Index node, double begin, double end) {
  return node == kLegendreDegree ? end : begin + (end - begin) * (1 + GetLegendreBasis().nodes[node]) / 2;
}

// Times are rounded, and move the value of a source by that times its slope.
double RoundingOfTimes(double begin, double end) { return RoundingOf(2) * std::max(std::abs(begin), std::abs(end)); }

void AddSampleTimes(const TimeFunction& function, double horizon, std::vector<double>& times) {
  for (std::size_t k = 0; k < function.pieces.size(); ++k) {
    const auto* samples = std::get_if<SampledFunction>(&function.pieces[k].function);
    if (!samples) continue;
    const double begin = k == 0 ? 0 : std::max(0.0, function.pieces[k].start);
    const double end = k + 1 < function.pieces.size() ? std::min(horizon, function.pieces[k + 1].start) : horizon;
    for (const double time : samples->times) {
      if (time > begin && time < end) times.push_back(time);
    }
  }
}

}  // namespace

double SourceSampler::Beside(double t, Side side) {
  return std::nextafter(t, side == Side::kRight ? HUGE_VAL : -HUGE_VAL);
}

void SourceSampler::Sample(double begin, double end, StepSources& step) {
  const LegendreBasis& basis = GetLegendreBasis();
  const double length = end - begin;
  step.begin = begin;
  step.length = length;
  step.check_s = kCheckPosition;
  step.g.slope.resize(0, kLegendreSize);
  static const LegendreVector at_check_position = LegendreValues(kCheckPosition);
  const double time_rounding = RoundingOfTimes(begin, end);
  const auto sample = [&](Index size, const auto& evaluate, const auto& rounding_at, StepSource& source) {
    Vector& rounding = source.error.rounding;
    source.at_check.resize(size);
    evaluate(begin + length * (1 + kCheckPosition) / 2, Side::kLeft, source.at_check);
    rounding_.resize(size);
    if (source.is_steady) {
      // All values are this one.
      source.values.setZero(size, kLegendreSize);
      source.values.col(0) = source.at_check;
      source.size = source.at_check.cwiseAbs();
      rounding_at(begin + length / 2, rounding_);
      rounding = RoundingOf(kOperations) * source.size + rounding_;
      source.error.truncation.setZero(size);
      source.error.with_signs.setZero(size);
      return source.at_check.allFinite() && rounding.allFinite();
    }
    values_.resize(size, kLegendreSize);
    for (Index j = 0; j < kLegendreSize; ++j) {
      const double t = TimeOfNode(j, begin, end);
      // A node next to an end may be rounded to it.
      evaluate(t, basis.nodes[j] < 0 ? Side::kRight : Side::kLeft, values_.col(j));
    }
    source.values = InterpolateAtNodes(values_);
    source.size = RowMaxAbs(values_);
    slope_ = 2 / length * DerivativeOf(source.values);
    rounding.setZero(size);
    // Not at an end, where a formula may jump.
    for (const double s : {basis.nodes[1], basis.nodes[kLegendreDegree - 1]}) {
      rounding_at(begin + length * (1 + s) / 2, rounding_);
      rounding = rounding.cwiseMax(rounding_);
    }
    rounding = RoundingOf(kOperations) * source.size +
               rounding.cwiseMax(2 * time_rounding * slope_.cwiseAbs().rowwise().sum());
    source.error.with_signs = source.at_check - ValueOf(source.values, at_check_position);
    source.error.truncation = Beyond(source.error.with_signs, rounding);
    return source.error.with_signs.allFinite() && rounding.allFinite();
  };
  using Value = Eigen::Ref<Vector>;
  step.f.is_steady = sources_.FIsSteady(begin, end);
  step.g.is_steady = sources_.GIsSteady(begin, end);
  const bool f_finite = sample(
      sources_.num_states(), [&](double t, Side side, Value value) { F(t, side, value); },
      [&](double t, Value bound) { sources_.RoundingOfF(t, bound); }, step.f);
  const bool g_finite = sample(
      sources_.num_constraints(), [&](double t, Side side, Value value) { G(t, side, value); },
      [&](double t, Value bound) { sources_.RoundingOfG(t, bound); }, step.g);
  step.finite = f_finite && g_finite;
  evaluations_ += kLegendreSize + 1;
}

void SourceSampler::SampleSlope(StepSources& step) {
  const LegendreBasis& basis = GetLegendreBasis();
  const Index size = sources_.num_constraints();
  const double end = step.begin + step.length;
  values_.resize(size, kLegendreSize);
  rounding_.resize(size);
  step.g.slope_rounding.setZero(size);
  for (Index j = 0; j < kLegendreSize; ++j) {
    const Side side = basis.nodes[j] < 0 ? Side::kRight : Side::kLeft;
    sources_.SlopeOfG(Beside(TimeOfNode(j, step.begin, end), side), side, values_.col(j), rounding_);
    step.g.slope_rounding = step.g.slope_rounding.cwiseMax(rounding_);
  }
  step.g.slope = InterpolateAtNodes(values_);
  slope_ = 2 / step.length * DerivativeOf(step.g.slope);
  step.g.slope_rounding += RoundingOf(kOperations) * RowMaxAbs(values_) +
                           2 * RoundingOfTimes(step.begin, end) * slope_.cwiseAbs().rowwise().sum();
}

Sources::NonFinite SourceSampler::WhyNonFinite(const StepSources& step) {
  const double end = step.begin + step.length;
  std::vector<double> times;
  for (const double node : GetLegendreBasis().nodes) times.push_back(step.begin + step.length * (1 + node) / 2);
  times.push_back(end);
  times.push_back(step.begin + step.length * (1 + step.check_s) / 2);
  const std::vector<double> between = cells_.TimesToCheck(step.begin, end);
  times.insert(times.end(), between.begin(), between.end());
  std::sort(times.begin(), times.end());
  true_f_.resize(sources_.num_states());
  true_g_.resize(sources_.num_constraints());
  double largest = 0;
  Sources::NonFinite where{step.begin, {}};
  for (const double t : times) {
    const Side side = t == end ? Side::kLeft : Side::kRight;
    F(t, side, true_f_);
    G(t, side, true_g_);
    const auto look = [&](const char* name, const Vector& values) {
      for (Index i = 0; i < values.size(); ++i) {
        const std::string entry = name + ("[" + std::to_string(i) + "]"), at = " at t = " + FormatNumber(t);
        if (!std::isfinite(values[i])) {
          where = {t, entry + " is " + FormatNumber(values[i]) + at + "; every value must be finite"};
          return true;
        }
        if (std::abs(values[i]) <= largest) continue;
        largest = std::abs(values[i]);
        where = {t, entry + " is " + FormatNumber(values[i]) + at + ": its derivatives overflow. Choose other units"};
      }
      return false;
    };
    if (look("f", true_f_) || look("g", true_g_)) return where;
  }
  return where;
}

bool SourceSampler::Probe(StepSources& step) {
  bool raised = false;
  const auto look = [&](const LegendreVector& at, const Vector& true_value, const auto& rounding_at,
                        StepSource& source) {
    SignedErrorBounds& error = source.error;
    const Vector with_rounding = true_value - source.values * at;
    Vector here = Beyond(with_rounding, error.rounding);
    if ((here.array() <= error.truncation.array()).all()) return;
    // A value that is rounded more here than at the nodes shows no pulse.
    rounding_.resize(here.size());
    rounding_at(rounding_);
    here = Beyond(here, rounding_);
    for (Index i = 0; i < here.size(); ++i) {
      if (here[i] <= error.truncation[i]) continue;
      error.truncation[i] = here[i];  // a NaN, too
      error.with_signs[i] = with_rounding[i];
      raised = true;
    }
    step.finite = step.finite && true_value.allFinite();
  };
  true_f_.resize(sources_.num_states());
  true_g_.resize(sources_.num_constraints());
  for (const double t : cells_.TimesToCheck(step.begin, step.begin + step.length)) {
    const double s = 2 * (t - step.begin) / step.length - 1;
    const LegendreVector at = LegendreValues(s);
    const Side side = s < 0 ? Side::kRight : Side::kLeft;  // times next to an end may be rounded to it
    F(t, side, true_f_);
    const auto rounding_of_f = [&](Vector& bound) { sources_.RoundingOfF(t, bound); };
    look(at, true_f_, rounding_of_f, step.f);
    G(t, side, true_g_);
    const auto rounding_of_g = [&](Vector& bound) { sources_.RoundingOfG(t, bound); };
    look(at, true_g_, rounding_of_g, step.g);
    ++evaluations_;
  }
  return raised;
}

std::optional<double> SourceSampler::FindKink(const StepSources& step) {
  constexpr double kSmooth = 1e-13;
  constexpr double kNarrow = 1e-6;
  constexpr double kDecays = 1.0 / 256;
  if (!step.finite) return std::nullopt;
  const auto roughness_of = [&step](const StepSources& part) {
    const auto largest = [](const StepSource& source, const Vector& size) {
      const Vector tail = EstimateTail(source.values) + source.error.truncation;
      double ratio = 0;
      for (Index i = 0; i < tail.size(); ++i) {
        if (size[i] > 0) ratio = NanMax(ratio, tail[i] / size[i]);
      }
      return ratio;
    };
    return NanMax(largest(part.f, step.f.size), largest(part.g, step.g.size));
  };
  double whole = roughness_of(step);
  if (whole <= kSmooth) return std::nullopt;
  StepSources part;
  const auto roughness = [&](double from, double to) {
    Sample(from, to, part);
    return roughness_of(part);
  };
  const double begin = step.begin, end = step.begin + step.length;
  const double narrow = kNarrow * (end - begin);
  double from = begin, to = end;
  while (true) {
    const double middle = from + (to - from) / 2;
    if (!(from < middle && middle < to)) break;
    const double left = roughness(from, middle), right = roughness(middle, to);
    if (!(std::isfinite(left) && std::isfinite(right))) return std::nullopt;
    if (std::max(left, right) <= kSmooth) {
      // On both sides: a kink between them, or none at all.
      if (to - from > narrow) return std::nullopt;
      return WhereTheyMeet(begin, from, to, end);
    }
    // A kink in f' remains half as large, one in f'' a quarter; nothing is left of an oscillation.
    const double rougher = std::max(left, right);
    if (rougher < kDecays * whole) return std::nullopt;
    whole = rougher;
    (left >= right ? to : from) = middle;
  }
  return to - from <= narrow ? std::optional<double>(to) : std::nullopt;
}

// A kink in [from, to], around which the sources are smooth: by the polynomials on both sides, of the component that
// bends most.
double SourceSampler::WhereTheyMeet(double begin, double from, double to, double end) {
  // Short for the sources, and long beside the millionth of the step that [from, to] is at most: any part between the
  // two, and so a factor of 4, gives the same place.
  constexpr double kBeside = 1e-3;
  const double width = std::min({kBeside * (end - begin), from - begin, end - to});
  if (!(width > 4 * (to - from))) return to;
  StepSources left, right;
  Sample(from - width, from, left);
  Sample(to, to + width, right);
  const LegendreVector at_begin = LegendreValues(-1), at_end = LegendreValues(1);
  const double beyond = 2 * (to - from) / width;
  const LegendreVector before = LegendreValues(-1 - beyond), behind = LegendreValues(1 + beyond);
  double most = 0, part = 1;
  const auto look = [&](const StepSource& of_left, const StepSource& of_right) {
    const Vector size = of_left.size.cwiseMax(of_right.size);
    const Vector at_from = of_right.values * before - of_left.values * at_end;
    const Vector at_to = of_right.values * at_begin - of_left.values * behind;
    for (Index i = 0; i < size.size(); ++i) {
      const double bend = std::abs(at_to[i] - at_from[i]);
      if (!(bend > most * size[i]) || !(at_from[i] * at_to[i] <= 0)) continue;
      most = bend / size[i];
      part = std::abs(at_from[i]) / bend;
    }
  };
  look(left.f, right.f);
  look(left.g, right.g);
  return from + part * (to - from);
}

void SourceSampler::TermsOfF(double t, Eigen::Ref<Vector> terms) {
  sources_.RoundingOfF(t, terms);
  Vector value(terms.size());
  F(t, Side::kLeft, value);
  terms = value.cwiseAbs() + terms / std::numeric_limits<double>::epsilon();
}

void SourceSampler::TermsOfG(double t, Eigen::Ref<Vector> terms) {
  sources_.RoundingOfG(t, terms);
  Vector value(terms.size());
  G(t, Side::kLeft, value);
  terms = value.cwiseAbs() + terms / std::numeric_limits<double>::epsilon();
}

bool SourceSampler::GJumps(double time, const Vector& allowed) {
  const Index n = sources_.num_constraints();
  Vector before(n), left(n), right(n), behind(n);
  G(time * (1 - RoundingOf(8)), Side::kRight, before);
  G(time, Side::kLeft, left);
  G(time, Side::kRight, right);
  G(time * (1 + RoundingOf(8)), Side::kLeft, behind);
  const Vector noise = (left - before).cwiseAbs() + (behind - right).cwiseAbs();
  return ((right - left).array().abs() > allowed.array() + noise.array()).any();
}

void SourceSampler::MoveCheck(double s, StepSources& step) {
  const double t = step.begin + step.length * (1 + s) / 2;
  step.check_s = s;
  F(t, Side::kLeft, step.f.at_check);
  G(t, Side::kLeft, step.g.at_check);
  ++evaluations_;
}

std::vector<double> KnownKinks(const Problem& problem) {
  std::vector<double> times = BreakPoints(problem);
  AddSampleTimes(problem.f, problem.horizon, times);
  AddSampleTimes(problem.g, problem.horizon, times);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

}  // namespace dlcs
