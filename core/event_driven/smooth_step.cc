// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/smooth_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/event_driven/error_growth.h"
#include "core/event_driven/first_crossing.h"
#include "core/linalg/abs_times.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr double kUnit = std::numeric_limits<double>::epsilon();
constexpr double kRounding = 64 * kUnit;
// The noise of sources is an upper bound; that of one value is kUnit / kRoundingOfValues of it.
constexpr double kRoundingOfValues = 16 * kUnit;
// The part of that which one coefficient may hold.
constexpr double kOfCoefficient = 1.0 / 8;
// A guard ends a mode where it falls below zero by this part of the tolerance, relative to its size on the step: where
// modes accumulate, all sizes are small. A smaller violation is a negligible error.
constexpr double kLevelPart = 1e-6;
// If the rate of a row, times half a step, is larger than this, its value at the end does not depend on that at the
// start.
constexpr double kForgets = 2;

LegendreSeries Output(const LinearOutput& output, const LegendreSeries& x, const StepSources& sources) {
  LegendreSeries series = output.state * x;
  if (output.g.size() > 0) series.noalias() += output.g * sources.g;
  if (output.f.size() > 0) series.noalias() += output.f * sources.f;
  if (output.slope.size() > 0) series.noalias() += output.slope * sources.slope;
  return series;
}

// The slope is a difference of values of g over the step, times up to K²: what numbers of the size `of_g` come to in
// it. Its integral has them without that factor.
constexpr double kOfSlope = kLegendreDegree * kLegendreDegree;
Vector OfSlope(const StepSources& sources, const Vector& of_g) { return kOfSlope * 2 / sources.length * of_g; }

// |output| applied to the given sizes of its arguments.
Vector Size(const LinearOutput& output, const Vector& x, const Vector& f, const Vector& g, const Vector& slope) {
  Vector size = AbsTimes(output.state, x);
  if (output.g.size() > 0) size += AbsTimes(output.g, g);
  if (output.f.size() > 0) size += AbsTimes(output.f, f);
  if (output.slope.size() > 0) size += AbsTimes(output.slope, slope);
  return size;
}

// An upper bound of |series| on the step.
Vector SizeOf(const LegendreSeries& series) { return series.cwiseAbs().rowwise().sum(); }

// What errors of f and g are of x'.
Vector AtSlope(const Mode& mode, const Vector& f, const Vector& g) {
  Vector slope = mode.source_f.size() > 0 ? AbsTimes(mode.source_f, f) : f;
  if (mode.source_g.size() > 0) slope += AbsTimes(mode.source_g, g);
  return slope;
}

// Half the length of the step in the times in which the terms of each row act, at most some: by these stiff rows answer
// to rounding in their coefficients, which come to (2k + 1) times that of an integral.
Vector Stiffness(const Mode& mode, const Vector& x_size, double length) {
  constexpr double kMost = 2 * kLegendreDegree + 1;
  const Vector change = length / 2 * AbsTimes(mode.dynamics, x_size);
  Vector stiffness(x_size.size());
  for (Index i = 0; i < x_size.size(); ++i) stiffness[i] = change[i] > 0 ? std::min(kMost, change[i] / x_size[i]) : 0;
  return stiffness;
}

// The part of each row that is a multiple of P_K - P_{K-1}: what a fast state that does not start where it settles
// leaves on a step that is far longer than it takes to. No Radau point sees it, and what it is to decay from is the
// whole error: nothing follows it.
Vector LayerOf(const Mode& mode, const LegendreSeries& x, double length) {
  constexpr Index K = kLegendreDegree;
  constexpr double kFast = 20 * K;
  constexpr double kCancels = 1.0 / 8;
  Vector layer = Vector::Zero(x.rows());
  for (Index i = 0; i < layer.size(); ++i) {
    if (!(length / 2 * std::abs(mode.dynamics(i, i)) > kFast)) continue;
    const double part = (x(i, K) - x(i, K - 1)) / 2;
    if (std::abs(x(i, K) + x(i, K - 1)) <= kCancels * std::abs(part)) layer[i] = part;
  }
  return layer;
}

LegendreSeries WithoutLayer(LegendreSeries series, const Vector& layer) {
  series.col(kLegendreDegree) -= layer;
  series.col(kLegendreDegree - 1) += layer;
  return series;
}

// The largest size of what `start` and a constant `source` make of x on the step, at a few times.
Vector LargestAnswer(const ModeStepper& stepper, const Vector& start, const Vector& source) {
  static const Matrix at = [] {
    LegendreRows rows;
    LegendreValuesAt(Vector{{-0.9, -0.4, 0.3, 1}}, rows);
    return Matrix(rows.transpose());
  }();
  return RowMaxAbs(stepper.Respond(start, source, at));
}

double LargestRatio(const Vector& error, const Vector& allowed) {
  double largest = 0;
  for (Index i = 0; i < error.size(); ++i) largest = NanMax(largest, error[i] == 0 ? 0 : error[i] / allowed[i]);
  return largest;
}

// What is allowed of x and the guards.
struct Allowed {
  Vector x;
  Vector guard;
};

// For the given sizes of them.
Allowed AllowedErrors(const Mode& mode, const SmoothStep& step, const Vector& x_size, const Vector& guard_size,
                      const Magnitudes& magnitudes, double tolerance, double share) {
  constexpr double kLeastPartOfReach = 1e-7;
  constexpr double kLeastPartOfTerms = 1e-6;
  const Vector x_magnitude = magnitudes.x.cwiseMax(x_size).cwiseMax(kLeastPartOfReach * magnitudes.x_reach);
  Vector guard_magnitude = magnitudes.w;
  for (const Index i : mode.active) guard_magnitude[i] = magnitudes.y[i];
  guard_magnitude = guard_magnitude.cwiseMax(guard_size).cwiseMax(kLeastPartOfTerms * step.guard_terms);
  return {tolerance * share * x_magnitude + step.x_noise, tolerance * guard_magnitude + step.guard_noise};
}

double ErrorRatio(const SmoothStep& step, const Allowed& allowed) {
  return NanMax(LargestRatio(step.x_error, allowed.x), LargestRatio(step.guard_error, allowed.guard));
}

// SmoothStep::layer_length for the given layers of x. A layer of little more than is allowed may be one of rounding, of
// which shorter steps have more.
double LayerLength(const Mode& mode, const Vector& layer, const Allowed& allowed) {
  constexpr double kResolved = 8;  // times in which a fast state settles, on one step
  constexpr double kClearlyMore = 32;
  double fastest = 0;
  for (Index i = 0; i < layer.size(); ++i) {
    if (layer[i] == 0) continue;
    const double missed = 2 * std::abs(layer[i]) / kClearlyMore;
    const bool counts =
        missed > allowed.x[i] || (missed * mode.guard.state.col(i).cwiseAbs().array() > allowed.guard.array()).any();
    if (counts) fastest = std::max(fastest, std::abs(mode.dynamics(i, i)));
  }
  return kResolved / fastest;
}

}  // namespace

SourceGap GapOf(const StepSources& sources) {
  return {sources.f_error + EstimateTail(sources.f), sources.g_error + EstimateTail(sources.g),
          EstimateTail(sources.slope)};
}

SmoothStep TakeSmoothStep(const Mode& mode, const Eigen::Ref<const Vector>& start, const StepSources& sources,
                          const Magnitudes& magnitudes, double tolerance, double share, const SourceGap* gap) {
  LegendreSeries b = mode.source_f.size() > 0 ? LegendreSeries(mode.source_f * sources.f) : sources.f;
  if (mode.source_g.size() > 0) b.noalias() += mode.source_g * sources.g;
  if (mode.source_slope.size() > 0) b.noalias() += mode.source_slope * sources.slope;

  SmoothStep step;
  step.stepper = std::make_shared<ModeStepper>(mode, sources.length);
  ModeStepper::Solution solution = step.stepper->Solve(start, b);
  step.x = std::move(solution.x);
  Vector corrected = Vector::Zero(step.x.rows());
  if (mode.differentiated()) {
    // The equations of the mode keep its constraints, but for rounding; a change by no more than that would set fast
    // states off where they have settled.
    const Vector rounding = kRounding * (AbsTimes(mode.rows, SizeOf(step.x)) + AbsTimes(mode.rows_g, sources.g_size)) +
                            AbsTimes(mode.rows_g, sources.g_noise);
    const LegendreSeries residual = mode.rows * step.x + mode.rows_g * sources.g;
    if ((RowMaxAbs(residual).array() > rounding.array()).any()) {
      const LegendreSeries change = mode.correction * residual;
      step.x -= change;
      corrected = RowMaxAbs(change);
    }
  }
  // A layer is over before anything else moves, and its polynomial is not.
  const Vector layer = LayerOf(mode, step.x, sources.length);
  step.x = WithoutLayer(step.x, layer);
  step.y = Output(mode.y, step.x, sources);
  step.guard = Output(mode.guard, step.x, sources);

  const Vector x_size = SizeOf(step.x);
  const Vector slope_size = OfSlope(sources, sources.g_size);
  const Vector slope_noise = OfSlope(sources, sources.g_noise);
  Vector b_size = RowMaxAbs(b);
  Vector noise_of_slope = Vector::Zero(x_size.size());
  if (mode.source_slope.size() > 0) {
    noise_of_slope = AbsTimes(mode.source_slope, kUnit * slope_size + kUnit / kRoundingOfValues * slope_noise);
  }
  step.slope_noise = kUnit * (mode.dynamics_size * x_size + b_size) +
                     kUnit / kRoundingOfValues * AtSlope(mode, sources.f_noise, sources.g_noise) +
                     noise_of_slope / kOfSlope;
  step.slope_error = AtSlope(mode, sources.f_error, sources.g_error);
  const Vector stiffness = Stiffness(mode, x_size, sources.length);
  // Rounding as the equations answer to it; its signs are as good as any.
  const Vector signs = SignsOfRounding(x_size.size());
  const Vector answer = LargestAnswer(*step.stepper, kUnit * signs.cwiseProduct(x_size),
                                      signs.cwiseProduct(step.slope_noise + noise_of_slope));
  step.x_rounding = kRounding * x_size + kRounding / kUnit * answer + corrected;
  step.x_noise = (stiffness.array() > kForgets).select(step.x_rounding + magnitudes.x_noise, step.x_rounding);
  const Vector x_coefficients = kOfCoefficient * step.x_noise.cwiseProduct(stiffness.cwiseMax(1));
  step.x_tail = EstimateTail(step.x, x_coefficients);
  step.x_error = step.x_tail + 2 * layer.cwiseAbs() + solution.uncertainty;
  if ((step.slope_error.array() != 0).any()) {
    step.x_error += LargestAnswer(*step.stepper, Vector::Zero(x_size.size()), signs.cwiseProduct(step.slope_error));
  }

  step.guard_terms = Size(mode.guard, x_size, sources.f_size, sources.g_size, slope_size);
  step.guard_noise = kRounding * step.guard_terms;
  if (mode.guard.g.size() > 0) step.guard_noise += AbsTimes(mode.guard.g, sources.g_noise);
  if (mode.guard.f.size() > 0) step.guard_noise += AbsTimes(mode.guard.f, sources.f_noise);
  if (mode.guard.slope.size() > 0) step.guard_noise += AbsTimes(mode.guard.slope, slope_noise);
  const Vector guard_coefficients = kOfCoefficient * step.guard_noise + AbsTimes(mode.guard.state, x_coefficients);
  step.guard_noise += AbsTimes(mode.guard.state, step.x_noise);
  step.guard_tail = EstimateTail(step.guard, guard_coefficients);
  const Vector guard_size = SizeOf(step.guard);
  step.guard_error =
      step.guard_tail + 2 * (mode.guard.state * layer).cwiseAbs() + AbsTimes(mode.guard.g, sources.g_error);
  const Allowed allowed = AllowedErrors(mode, step, x_size, guard_size, magnitudes, tolerance, share);
  step.error_ratio = ErrorRatio(step, allowed);
  if (step.error_ratio > 1) step.layer_length = LayerLength(mode, layer, allowed);
  step.guard_level = (kLevelPart * tolerance * guard_size).cwiseMax(4 * step.guard_noise).cwiseMax(step.guard_tail);
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
  return ErrorRatio(step, AllowedErrors(mode, step, x_size, guard_size, magnitudes, tolerance, share));
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
