// SPDX-License-Identifier: Apache-2.0

#include "core/events/smooth_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/events/first_crossing.h"
#include "core/events/mode_step.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr double kRounding = 64 * std::numeric_limits<double>::epsilon();
// The part of that which one coefficient may hold.
constexpr double kOfCoefficient = 1.0 / 8;
// A guard ends a mode where it falls below zero by this part of the tolerance, relative to its size on the
// step: where modes accumulate, all sizes are small.
constexpr double kLevelPart = 1e-3;

LegendreSeries Output(const LinearOutput& output, const LegendreSeries& x, const StepSources& sources) {
  LegendreSeries series = output.state * x;
  if (output.g.size() > 0) series.noalias() += output.g * sources.g;
  if (output.f.size() > 0) series.noalias() += output.f * sources.f;
  if (output.slope.size() > 0) series.noalias() += output.slope * sources.slope;
  return series;
}

// The slope is a difference of values of g over the step, times up to K².
Vector SlopeNoise(const StepSources& sources) {
  return kLegendreDegree * kLegendreDegree * 2 / sources.length * sources.g_size;
}

// |output| applied to the given sizes of its arguments.
Vector Size(const LinearOutput& output, const Vector& x, const Vector& f, const Vector& g,
            const Vector& slope) {
  Vector size = output.state.cwiseAbs() * x;
  if (output.g.size() > 0) size += output.g.cwiseAbs() * g;
  if (output.f.size() > 0) size += output.f.cwiseAbs() * f;
  if (output.slope.size() > 0) size += output.slope.cwiseAbs() * slope;
  return size;
}

// An upper bound of |series| on the step.
Vector SizeOf(const LegendreSeries& series) { return series.cwiseAbs().rowwise().sum(); }

// Components that are small beside others count as this part of them at least: what is zero at the start and
// grows like a power of time never is accurate in itself.
Vector Magnitude(const Vector& largest) {
  constexpr double kLeastPart = 1e-6;
  return largest.cwiseMax(kLeastPart * MaxAbs(largest));
}

double LargestRatio(const Vector& error, const Vector& allowed) {
  double largest = 0;
  for (Index i = 0; i < error.size(); ++i)
    largest = NanMax(largest, error[i] == 0 ? 0 : error[i] / allowed[i]);
  return largest;
}

// What SmoothStep::error_ratio is for the given sizes of x and the guards.
double ErrorRatio(const Mode& mode, const SmoothStep& step, const Vector& x_size, const Vector& guard_size,
                  const Magnitudes& magnitudes, double tolerance, double share) {
  const Vector x_allowed = tolerance * share * Magnitude(magnitudes.x.cwiseMax(x_size)) + step.x_noise;
  Vector guard_magnitude = Magnitude(magnitudes.w);
  const Vector y_magnitude = Magnitude(magnitudes.y);
  for (const Index i : mode.active) guard_magnitude[i] = y_magnitude[i];
  const Vector guard_allowed = tolerance * guard_magnitude.cwiseMax(guard_size) + step.guard_noise;
  return NanMax(LargestRatio(step.x_error, x_allowed), LargestRatio(step.guard_error, guard_allowed));
}

}  // namespace

SourceGap GapOf(const StepSources& sources) {
  return {sources.f_error + EstimateTail(sources.f), sources.g_error + EstimateTail(sources.g),
          EstimateTail(sources.slope)};
}

SmoothStep TakeSmoothStep(const Mode& mode, const Eigen::Ref<const Vector>& start, const StepSources& sources,
                          const Magnitudes& magnitudes, double tolerance, double share,
                          const SourceGap* gap) {
  LegendreSeries b = mode.source_f.size() > 0 ? LegendreSeries(mode.source_f * sources.f) : sources.f;
  if (mode.source_g.size() > 0) b.noalias() += mode.source_g * sources.g;
  if (mode.source_slope.size() > 0) b.noalias() += mode.source_slope * sources.slope;

  SmoothStep step;
  step.x = StepMode(mode, start, b, sources.length);
  step.y = Output(mode.y, step.x, sources);
  step.guard = Output(mode.guard, step.x, sources);

  const Vector x_size = SizeOf(step.x);
  const Vector slope_size = SlopeNoise(sources);
  Vector b_size = RowMaxAbs(b);
  if (mode.source_slope.size() > 0) b_size += mode.source_slope.cwiseAbs() * slope_size;
  // The Schur form mixes all components, and their rounding.
  const double state_noise = kRounding * MaxAbs(x_size);
  step.x_noise =
      (kRounding * sources.length / 2 * (mode.dynamics.cwiseAbs() * x_size + b_size)).array() + state_noise;
  step.x_error = EstimateTail(step.x, kOfCoefficient * step.x_noise) + sources.length * sources.f_error;

  step.guard_noise = kRounding * Size(mode.guard, x_size, sources.f_size, sources.g_size, slope_size) +
                     mode.guard.state.cwiseAbs() * step.x_noise;
  if (mode.guard.g.size() > 0) step.guard_noise += mode.guard.g.cwiseAbs() * sources.g_noise;
  const Vector guard_tail = EstimateTail(step.guard, kOfCoefficient * step.guard_noise);
  const Vector guard_size = SizeOf(step.guard);
  step.guard_error = guard_tail + mode.guard.g.cwiseAbs() * sources.g_error;
  step.error_ratio = ErrorRatio(mode, step, x_size, guard_size, magnitudes, tolerance, share);
  step.guard_level = (kLevelPart * tolerance * guard_size).cwiseMax(4 * step.guard_noise).cwiseMax(guard_tail);
  if (gap) step.guard_level += Size(mode.guard, Vector::Zero(step.x.rows()), gap->f, gap->g, gap->slope);
  return step;
}

double ErrorRatioBefore(double s, const Mode& mode, const SmoothStep& step, const Magnitudes& magnitudes,
                        double tolerance, double share) {
  constexpr int kLooks = 4;
  Vector x_size = Vector::Zero(step.x.rows()), guard_size = Vector::Zero(step.guard.rows());
  for (int k = 0; k <= kLooks; ++k) {
    const LegendreVector at = LegendreValues(-1 + (1 + s) * k / kLooks);
    x_size = x_size.cwiseMax((step.x * at).cwiseAbs());
    guard_size = guard_size.cwiseMax((step.guard * at).cwiseAbs());
  }
  return ErrorRatio(mode, step, x_size, guard_size, magnitudes, tolerance, share);
}

namespace {

// The zero of the series a little before `s`, where it is -level and falling; `s` itself where it only grazes
// zero.
double ZeroBefore(const LegendreVector& series, double s, double level) {
  const LegendreVector slope = GetLegendreBasis().derivative.transpose() * series;
  double zero = s;
  for (int iteration = 0; iteration < 3; ++iteration) {
    const LegendreVector at = LegendreValues(zero);
    const double next = zero - series.dot(at) / slope.dot(at);
    if (!(next >= -1 && next <= s)) return s;
    zero = next;
  }
  return std::abs(series.dot(LegendreValues(zero))) < level / 16 ? zero : s;
}

}  // namespace

std::optional<ModeEnd> FindModeEnd(const SmoothStep& step) {
  std::optional<ModeEnd> end;
  for (Index i = 0; i < step.guard.rows(); ++i) {
    const auto s = FirstCrossing(step.guard.row(i).transpose(), step.guard_level[i], end ? end->s : 1);
    if (s && (!end || *s < end->s)) end = {*s, i};
  }
  if (end) end->s = ZeroBefore(step.guard.row(end->guard).transpose(), end->s, step.guard_level[end->guard]);
  return end;
}

}  // namespace dlcs
