// SPDX-License-Identifier: Apache-2.0

#include "core/events/step_sources.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// Not a node, and not symmetric to one: between the two nodes right of the middle.
constexpr double kCheckPosition = 0.1305;
// Of interpolation: what a polynomial may be off without having missed anything.
constexpr double kRounding = 32 * std::numeric_limits<double>::epsilon();

void AddSampleTimes(const TimeFunction& function, double horizon, std::vector<double>& times) {
  for (std::size_t k = 0; k < function.pieces.size(); ++k) {
    const auto* samples = std::get_if<SampledFunction>(&function.pieces[k].function);
    if (!samples) continue;
    const double begin = k == 0 ? 0 : std::max(0.0, function.pieces[k].start);
    const double end =
        k + 1 < function.pieces.size() ? std::min(horizon, function.pieces[k + 1].start) : horizon;
    for (const double time : samples->times) {
      if (time > begin && time < end) times.push_back(time);
    }
  }
}

}  // namespace

double SourceSampler::Beside(double t, Side side) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return std::nextafter(t, side == Side::kRight ? kInfinity : -kInfinity);
}

void SourceSampler::Sample(double begin, double end, StepSources& step) {
  const LegendreBasis& basis = GetLegendreBasis();
  const double length = end - begin;
  step.begin = begin;
  step.length = length;
  step.check_s = kCheckPosition;
  // t is rounded, and moves the value of a source by that times its slope.
  const double time_rounding = std::numeric_limits<double>::epsilon() * std::max(std::abs(begin), std::abs(end));
  const auto sample = [&](Index size, const auto& evaluate, LegendreSeries& series, LegendreSeries& slope,
                          Vector& largest, Vector& noise, Vector& at_check, Vector& error) {
    values_.resize(size, kLegendreSize);
    for (Index j = 0; j < kLegendreSize; ++j) {
      const double t = j == kLegendreDegree ? end : begin + length * (1 + basis.nodes[j]) / 2;
      evaluate(t, j == 0 ? Side::kRight : Side::kLeft, values_.col(j));
    }
    series = InterpolateAtNodes(values_);
    largest = RowMaxAbs(values_);
    at_check.resize(size);
    evaluate(begin + length * (1 + kCheckPosition) / 2, Side::kLeft, at_check);
    slope = series * (2 / length * basis.derivative);
    noise = kRounding * largest + 2 * time_rounding * slope.cwiseAbs().rowwise().sum();
    error = (series * LegendreValues(kCheckPosition) - at_check).cwiseAbs() - noise;
    const bool finite = error.allFinite();
    error = error.cwiseMax(0);
    return finite;
  };
  using Value = Eigen::Ref<Vector>;
  const bool f_finite = sample(
      sources_.num_states(), [&](double t, Side side, Value value) { F(t, side, value); }, step.f,
      f_slope_, step.f_size, step.f_noise, step.f_at_check, step.f_error);
  const bool g_finite = sample(
      sources_.num_constraints(), [&](double t, Side side, Value value) { G(t, side, value); }, step.g,
      step.slope, step.g_size, step.g_noise, step.g_at_check, step.g_error);
  step.finite = f_finite && g_finite;
  evaluations_ += kLegendreSize + 1;
}

bool SourceSampler::Probe(StepSources& step) {
  const double end = step.begin + step.length;
  bool raised = false;
  const auto look = [&](const LegendreSeries& series, const LegendreVector& at, const Vector& noise, Vector& error) {
    const Vector missed = (series * at - true_value_).cwiseAbs() - noise;
    for (Index i = 0; i < error.size(); ++i) {
      if (missed[i] <= error[i]) continue;
      error[i] = missed[i];  // a NaN, too
      raised = true;
    }
    step.finite = step.finite && true_value_.allFinite();
  };
  for (auto t = std::upper_bound(probes_.begin(), probes_.end(), step.begin); t != probes_.end() && *t < end; ++t) {
    const LegendreVector at = LegendreValues(2 * (*t - step.begin) / step.length - 1);
    true_value_.resize(sources_.num_states());
    F(*t, Side::kLeft, true_value_);
    look(step.f, at, step.f_noise, step.f_error);
    true_value_.resize(sources_.num_constraints());
    G(*t, Side::kLeft, true_value_);
    look(step.g, at, step.g_noise, step.g_error);
    ++evaluations_;
  }
  return raised;
}

void SourceSampler::MoveCheck(double s, StepSources& step) {
  const double t = step.begin + step.length * (1 + s) / 2;
  step.check_s = s;
  F(t, Side::kLeft, step.f_at_check);
  G(t, Side::kLeft, step.g_at_check);
  ++evaluations_;
}

std::vector<double> ProbeTimes(const Problem& problem) {
  constexpr int kProbes = 128;
  constexpr double kGoldenRatio = 0.61803398874989484820;
  const auto is_formula = [](const TimeFunction::Piece& piece) {
    return std::holds_alternative<FormulaFunction>(piece.function);
  };
  const auto has_formulas = [&](const TimeFunction& function) {
    return std::any_of(function.pieces.begin(), function.pieces.end(), is_formula);
  };
  std::vector<double> times;
  if (!has_formulas(problem.f) && !has_formulas(problem.g)) return times;
  for (int k = 0; k < kProbes; ++k) {
    const double shift = kGoldenRatio * k;
    times.push_back(problem.horizon * (k + (shift - std::floor(shift))) / kProbes);
  }
  return times;
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
