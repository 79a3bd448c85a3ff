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
// The rounding error of a coefficient is less than so many times what one more correction changes.
constexpr double kOfShown = 8;
// A guard ends a mode where it falls below zero by this part of the tolerance, relative to its size on the step: where
// modes accumulate, all sizes are small. A smaller violation is a negligible error.
constexpr double kLevelPart = 1e-6;
// The noise of x' is that of single roundings.
constexpr double kOfSlopes = 16;
LegendreSeries Output(const LinearOutput& output, const ModeStepper::Solution& solution, const StepSources& sources) {
  LegendreSeries series = Apply(output.state, solution.x);
  if (output.g.size() > 0) series += Apply(output.g, sources.g);
  if (output.f.size() > 0) series += Apply(output.f, sources.f);
  if (output.slope.size() > 0) series += Apply(output.slope, solution.slope);
  return series;
}

// |output| applied to the given sizes of its arguments; `slope` may be empty.
Vector Size(const LinearOutput& output, const Vector& x, const Vector& slope, const Vector& f, const Vector& g) {
  Vector size = AbsTimes(output.state, x);
  if (output.g.size() > 0) size += AbsTimes(output.g, g);
  if (output.f.size() > 0) size += AbsTimes(output.f, f);
  if (output.slope.size() > 0 && slope.size() > 0) size += AbsTimes(output.slope, slope);
  return size;
}

// An upper bound of |series| on the step.
Vector SizeOf(const LegendreSeries& series) { return series.cwiseAbs().rowwise().sum(); }

// What errors of f and g are in the equations of the mode.
Vector InRows(const Mode& mode, const Vector& f, const Vector& g) {
  Vector rows = mode.is_explicit() ? f : AbsTimes(mode.E, f);
  if (mode.source_g.size() > 0) rows += AbsTimes(mode.source_g, g);
  return rows;
}

// What columns of `start` and constant `source` make of x on the step, at kAnswers times, the last one its end: all
// times of the first column, then of the second.
constexpr Index kAnswers = 4;
Matrix Answers(const ModeStepper& stepper, const Matrix& start, const Matrix& source) {
  static const Matrix at = [] {
    LegendreRows rows;
    LegendreValuesAt(Vector{{-0.9, -0.4, 0.3, 1}}, rows);
    return Matrix(rows.transpose());
  }();
  return stepper.Respond(start, source, at).values;
}

double LargestRatio(const Vector& error, const Vector& allowed) {
  double largest = 0;
  for (Index i = 0; i < error.size(); ++i) largest = NanMax(largest, error[i] == 0 ? 0 : error[i] / allowed[i]);
  return largest;
}

// What is allowed of x and the guards.
struct Allowed {
  Vector x;
  Vector layer;
  Vector guard;
};

struct StatesAndGuards {
  Vector x, guard;
};

// For the given sizes and rounding errors of them.
Allowed AllowedErrors(const Mode& mode, const SmoothStep& step, const StatesAndGuards& sizes,
                      const StatesAndGuards& noise, const Magnitudes& magnitudes, double tolerance, double share) {
  constexpr double kMinPartOfReach = 1e-7;
  constexpr double kMinPartOfTerms = 1e-6;
  const Vector x_magnitude = magnitudes.x.cwiseMax(sizes.x).cwiseMax(kMinPartOfReach * magnitudes.x_reach);
  Vector guard_magnitude = magnitudes.w;
  for (const Index i : mode.active) guard_magnitude[i] = magnitudes.y[i];
  guard_magnitude = guard_magnitude.cwiseMax(sizes.guard).cwiseMax(kMinPartOfTerms * step.guard_terms);
  return {tolerance * share * x_magnitude + noise.x, tolerance * x_magnitude + noise.x,
          tolerance * guard_magnitude + noise.guard};
}

double ErrorRatio(const SmoothStep& step, const Allowed& allowed) {
  const double of_x = NanMax(LargestRatio(step.x_error, allowed.x), LargestRatio(step.layer, allowed.layer));
  return NanMax(of_x, LargestRatio(step.guard_error, allowed.guard));
}

// Sets the lengths that resolve the given parts of layers. A layer that is little more than allowed may be one of
// rounding, of which shorter steps have more.
void SetLayerLengths(const Mode& mode, const Eigen::VectorXcd& parts, const Allowed& allowed, SmoothStep& step) {
  constexpr double kResolved = 8;  // times in which a fast state settles, on one step
  constexpr double kClearlyMore = 32;
  for (Index j = 0; j < parts.size(); ++j) {
    if (parts[j] == 0.0 || mode.form.Slope(j, j) == 0.0) continue;
    const Vector missed = 2 * (mode.form.vectors.col(j) * parts[j]).cwiseAbs();
    const double ratio =
        std::max(LargestRatio(missed, allowed.layer), LargestRatio(AbsTimes(mode.guard.state, missed), allowed.guard));
    const double length = kResolved / std::abs(mode.form.triangle(j, j) / mode.form.Slope(j, j));
    if (ratio > 1) step.small_layer_length = std::min(step.small_layer_length, length);
    if (ratio > kClearlyMore) step.layer_length = std::min(step.layer_length, length);
  }
}

}  // namespace

Vector SlopeAt(const SmoothStep& step, const StepSources& sources, double s) {
  return 2 / sources.length * ValueOf(step.x, LegendreSlopes(LegendreValues(s)));
}

EventGap GapOf(const SmoothStep& step, const StepSources& sources) {
  return {step.x_tail, sources.f_error + EstimateTail(sources.f), sources.g_error + EstimateTail(sources.g)};
}

SmoothStep TakeSmoothStep(const Mode& mode, const Eigen::Ref<const Vector>& start, const StepSources& sources,
                          const Magnitudes& magnitudes, double tolerance, double share, const EventGap* gap) {
  LegendreSeries b = mode.is_explicit() ? sources.f : Apply(mode.E, sources.f);
  if (mode.source_g.size() > 0) b += Apply(mode.source_g, sources.g);

  SmoothStep step;
  step.stepper = std::make_shared<ModeStepper>(mode, sources.length);
  const Vector noise_of_sources = kUnit / kRoundingOfValues * InRows(mode, sources.f_noise, sources.g_noise);
  ModeStepper::Solution solution = step.stepper->Solve(start, b, noise_of_sources);
  step.unreached = solution.unreached;
  step.layer = 2 * solution.layer.cwiseAbs();
  step.y = Output(mode.y, solution, sources);
  step.guard = Output(mode.guard, solution, sources);
  step.x = std::move(solution.x);

  const Vector x_size = SizeOf(step.x);
  const Vector slope_size = mode.is_explicit() ? Vector() : SizeOf(solution.slope);
  const Vector of_sources = RowMaxAbs(b) + 1 / kUnit * noise_of_sources;
  Vector rows_size = AbsTimes(mode.F, x_size) + of_sources;
  step.row_noise = mode.F_terms * x_size + of_sources;
  step.slope_size = step.row_noise;
  if (!mode.is_explicit()) {
    rows_size += AbsTimes(mode.E, slope_size);
    step.row_noise += mode.E_terms * slope_size;
    step.slope_size = slope_size + AbsTimes(mode.dynamics, x_size);
  }
  step.row_noise *= kUnit;
  step.row_error = InRows(mode, sources.f_error, sources.g_error);
  const auto is_stiff = solution.stiffness.array() > ModeStepper::Solution::kForgets;
  // Rounding as the equations answer to it; its signs are as good as any.
  const Vector signs = SignsOfRounding(x_size.size());
  // These signs may cancel in a guard by chance: once more with one sign.
  Matrix start_of_rounding(x_size.size(), 2), source_of_rounding(x_size.size(), 2);
  start_of_rounding << signs.cwiseProduct(x_size), x_size;
  source_of_rounding << signs.cwiseProduct(rows_size), rows_size;
  const Matrix answers = kRounding * Answers(*step.stepper, start_of_rounding, source_of_rounding);
  step.x_rounding = kRounding * x_size + RowMaxAbs(answers.leftCols(kAnswers));
  step.rounding_at_end = answers(Eigen::all, Eigen::seqN(kAnswers - 1, 2, kAnswers));
  step.x_noise = is_stiff.select(step.x_rounding + magnitudes.x_noise, step.x_rounding);
  Vector x_coefficients = kOfCoefficient * step.x_noise.cwiseProduct(solution.stiffness.cwiseMax(1));
  // That is an upper bound, with which a stiff row may hide a boundary layer: what rounding there is shows.
  const Vector shown = kOfShown * (kUnit * x_size + solution.last_noise) + magnitudes.x_noise;
  x_coefficients = is_stiff.select(x_coefficients.cwiseMin(shown), x_coefficients);
  step.x_tail = EstimateTail(step.x, x_coefficients);
  step.x_error = step.x_tail + solution.uncertainty + (solution.kept_layer - x_coefficients).cwiseMax(0);
  if ((step.row_error.array() != 0).any()) {
    step.x_error += RowMaxAbs(Answers(*step.stepper, Vector::Zero(x_size.size()), signs.cwiseProduct(step.row_error)));
  }

  step.guard_terms = Size(mode.guard, x_size, slope_size, sources.f_size, sources.g_size);
  step.guard_noise = kRounding * step.guard_terms;
  if (mode.guard.g.size() > 0) step.guard_noise += AbsTimes(mode.guard.g, sources.g_noise);
  if (mode.guard.f.size() > 0) step.guard_noise += AbsTimes(mode.guard.f, sources.f_noise);
  if (mode.guard.slope.size() > 0) step.guard_noise += kOfSlopes * AbsTimes(mode.guard.slope, solution.slope_noise);
  const Vector guard_coefficients = kOfCoefficient * step.guard_noise + AbsTimes(mode.guard.state, x_coefficients);
  // Where a guard tells small differences of states, as the voltage of a high resistance does of inductors that share
  // it, what rounding does to them mostly cancels.
  step.guard_noise += kRounding * AbsTimes(mode.guard.state, x_size) + RowMaxAbs(Matrix(mode.guard.state * answers));
  if (solution.IsStiff()) step.guard_noise += RowMaxAbs(Matrix(mode.guard.state * magnitudes.rounding));
  step.guard_tail = EstimateTail(step.guard, guard_coefficients);
  const Vector guard_size = SizeOf(step.guard);
  Vector lift = 2 * mode.guard.state * solution.layer;  // what the layer adds to the guards at the start
  step.guard_error = step.guard_tail + lift.cwiseAbs() + AbsTimes(mode.guard.g, sources.g_error);
  if (mode.guard.f.size() > 0) step.guard_error += AbsTimes(mode.guard.f, sources.f_error);
  const Allowed allowed =
      AllowedErrors(mode, step, {x_size, guard_size}, {step.x_noise, step.guard_noise}, magnitudes, tolerance, share);
  step.error_ratio = ErrorRatio(step, allowed);
  step.guard_allowed = allowed.guard;
  if (step.error_ratio > 1) SetLayerLengths(mode, solution.layer_parts, allowed, step);
  step.guard_level = (kLevelPart * tolerance * guard_size).cwiseMax(4 * step.guard_noise).cwiseMax(step.guard_tail);
  if (gap) {
    const Vector slope = mode.guard.slope.size() > 0 ? AbsTimes(mode.dynamics, gap->x) : Vector();
    step.guard_level += Size(mode.guard, gap->x, slope, gap->f, gap->g);
  }
  // A guard that a layer lifts from zero: at the start the polynomials already are what follows the layer.
  constexpr double kOfLayer = 1e-3;  // the slopes of a layer are no better known
  if (mode.guard.slope.size() > 0) lift += 2 * mode.guard.slope * (mode.dynamics * solution.layer);
  lift += kOfLayer * lift.cwiseAbs();
  const Vector at_start = ValueOf(step.guard, LegendreValues(-1));
  for (Index i = 0; i < at_start.size(); ++i) {
    if (at_start[i] < -step.guard_level[i] && at_start[i] + lift[i] >= -step.guard_level[i]) {
      step.guard_level[i] -= at_start[i];
    }
  }
  return step;
}

double ErrorRatioBefore(double s, const Mode& mode, const SmoothStep& step, const Magnitudes& magnitudes,
                        double tolerance, double share) {
  constexpr int kLooks = 4;
  Eigen::Matrix<double, kLegendreSize, kLooks + 1> at;
  for (int k = 0; k <= kLooks; ++k) at.col(k) = LegendreValues(-1 + (1 + s) * k / kLooks);
  const StatesAndGuards size{RowMaxAbs(Matrix(step.x.lazyProduct(at))), RowMaxAbs(Matrix(step.guard.lazyProduct(at)))};
  // Behind s they may grow, and their rounding with them.
  const auto before = [](const Vector& noise, const Vector& size, const LegendreSeries& series) {
    const Vector whole = SizeOf(series);
    return Vector((size.array() < whole.array()).select(noise.cwiseProduct(size).cwiseQuotient(whole), noise));
  };
  const StatesAndGuards noise{before(step.x_noise, size.x.cwiseMax(magnitudes.x), step.x),
                              before(step.guard_noise, size.guard, step.guard)};
  return ErrorRatio(step, AllowedErrors(mode, step, size, noise, magnitudes, tolerance, share));
}

bool Project(const Mode& mode, const StepSources& sources, double tolerance, Magnitudes& magnitudes, Vector& x) {
  constexpr double kRoundingOfTerms = 64 * kUnit;  // nothing is known of a residual that is not larger
  constexpr double kHarmless = 1e-12;              // corrections of this part of their terms are always allowed
  if (mode.num_algebraic == 0) return true;
  const Vector g = ValueOf(sources.g, LegendreValues(-1));
  const Matrix of_g = mode.algebraic_g();
  const Vector residual = mode.algebraic_rows() * x + of_g * g;
  const Vector size = mode.algebraic_rows().cwiseAbs() * x.cwiseAbs() + of_g.cwiseAbs() * g.cwiseAbs();
  const Vector rounding = kRoundingOfTerms * size + of_g.cwiseAbs() * sources.g_noise;
  const Vector change = mode.correction * residual;
  if ((residual.array().abs() <= rounding.array()).all()) {
    // Where rounding moves slow states off a constraint, fast states make up for it at once.
    magnitudes.x_noise = magnitudes.x_noise.cwiseMax(change.cwiseAbs());
    magnitudes.rounding.col(2) = change;
    return true;
  }
  const Vector terms = mode.correction.cwiseAbs() * size;
  const Vector allowed = tolerance * magnitudes.x + kHarmless * terms + magnitudes.x_noise;
  if ((change.array().abs() > allowed.array()).any()) return false;
  x -= change;
  magnitudes.x_noise += change.cwiseAbs().cwiseMin(mode.correction.cwiseAbs() * rounding);
  return true;
}

}  // namespace dlcs
