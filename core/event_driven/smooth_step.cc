// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/smooth_step.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/linalg/abs_times.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"
#include "core/linalg/weyl_sequence.h"

namespace dlcs {
namespace {

// The part of the noise of a row that one coefficient may hold. PlainSystems feels it.
constexpr double kOfCoefficient = 1.0 / 8;
// Of what a step makes of a row.
constexpr Index kOperationsOfStep = 128;

LegendreSeries Output(const LinearOutput& output, const ModeStepper::Solution& solution, const StepSources& sources) {
  LegendreSeries series = Apply(output.state, solution.x);
  if (output.g.size() > 0) AddApplied(output.g, sources.g.values, sources.g.is_steady, series);
  if (output.f.size() > 0) AddApplied(output.f, sources.f.values, sources.f.is_steady, series);
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

// What errors of f and g are in the equations of the mode.
Vector InRows(const Mode& mode, const Vector& f, const Vector& g) {
  Vector rows = mode.is_explicit() ? f : AbsTimes(mode.E, f);
  if (mode.source_g.size() > 0) rows += AbsTimes(mode.source_g, g);
  return rows;
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

// What starts at zero, or is a small difference, is not compared with less than this part of what it may become.
// SmoothStepTest feels it.
constexpr double kLeastPart = 1e-6;

// For the given sizes and rounding errors of them.
Allowed AllowedErrors(const Mode& mode, const SmoothStep& step, const StatesAndGuards& sizes,
                      const StatesAndGuards& noise, const Magnitudes& magnitudes, double tolerance, double share,
                      double least_part = kLeastPart) {
  const Vector x_magnitude =
      magnitudes.x.cwiseMax(sizes.x).cwiseMax(least_part * magnitudes.x_reach).cwiseMax(magnitudes.x_given);
  Vector guard_magnitude = magnitudes.w.cwiseMax(magnitudes.w_given);
  for (const Index i : mode.active) guard_magnitude[i] = std::max(magnitudes.y[i], magnitudes.y_given[i]);
  guard_magnitude = guard_magnitude.cwiseMax(sizes.guard).cwiseMax(least_part * step.guard.terms);
  return {tolerance * share * x_magnitude + noise.x, tolerance * x_magnitude + noise.x,
          tolerance * guard_magnitude + magnitudes.allowed_rounding * noise.guard};
}

double ErrorRatio(const SmoothStep& step, const Allowed& allowed) {
  const double of_x = NanMax(LargestRatio(step.x_error.truncation, allowed.x), LargestRatio(step.layer, allowed.layer));
  return NanMax(of_x, LargestRatio(step.guard.error.truncation, allowed.guard));
}

// Sets the lengths that resolve the given parts of layers. A layer that is little more than allowed may be one of
// rounding, of which shorter steps have more.
void SetLayerLengths(const Mode& mode, const Eigen::VectorXcd& parts, const Eigen::VectorXcd& slopes,
                     const Allowed& allowed, SmoothStep& step) {
  // SmoothStepTest feels both.
  constexpr double kResolved = 8;  // times in which a fast state settles, on one step
  constexpr double kClearlyMore = 32;
  for (Index j = 0; j < parts.size(); ++j) {
    if (parts[j] == 0.0 || mode.form.Slope(j, j) == 0.0) continue;
    const Vector missed = 2 * (mode.form.vectors.col(j) * parts[j]).cwiseAbs();
    Vector in_guards = AbsTimes(mode.guard.state, missed);
    if (slopes.size() > 0)
      in_guards += AbsTimes(mode.guard.slope, Vector((mode.form.vectors.col(j) * slopes[j]).cwiseAbs()));
    const double ratio = std::max(LargestRatio(missed, allowed.layer), LargestRatio(in_guards, allowed.guard));
    const double length = kResolved / std::abs(mode.form.triangle(j, j) / mode.form.Slope(j, j));
    if (ratio > 1) step.small_layer_length = std::min(step.small_layer_length, length);
    if (ratio > kClearlyMore) step.layer_length = std::min(step.layer_length, length);
  }
}

// Estimates the errors of a step from its polynomials: of the equations, of the states, then of the guards, in this
// order.
class StepErrors {
 public:
  // Keeps references. `step` has x, y, guard and stepper.
  StepErrors(const Mode& mode, const StepSources& sources, const Magnitudes& magnitudes,
             const ModeStepper::Solution& solution, SmoothStep& step)
      : mode_(mode),
        sources_(sources),
        magnitudes_(magnitudes),
        solution_(solution),
        step_(step),
        x_size_(SizeOfRows(step.x)),
        slope_size_(mode.is_explicit() ? Vector() : SizeOfRows(solution.slope)) {}

  // `size_of_source` bounds the source of each equation, and its rounding.
  void OfRows(const Vector& size_of_source);
  void OfStates();
  // Of the linear functions `output` of the solution, for which `rows` has the values. `lift`: what the layers that
  // were subtracted add to them at the start.
  void OfLinearRows(const LinearOutput& output, const Vector& lift, StepRows& rows) const;

  const Vector& x_size() const { return x_size_; }

 private:
  const Mode& mode_;
  const StepSources& sources_;
  const Magnitudes& magnitudes_;
  const ModeStepper::Solution& solution_;
  SmoothStep& step_;
  Vector x_size_, slope_size_, rows_size_;
  Matrix of_rounding_;     // what the system makes of rounding at the looks
  Vector x_coefficients_;  // what rounding may be of one coefficient of x
};

void StepErrors::OfRows(const Vector& size_of_source) {
  rows_size_ = AbsTimes(mode_.F, x_size_) + size_of_source;
  step_.row_error.rounding = mode_.F_terms * x_size_ + size_of_source;
  step_.slope_size = step_.row_error.rounding;
  if (!mode_.is_explicit()) {
    rows_size_ += AbsTimes(mode_.E, slope_size_);
    step_.row_error.rounding += mode_.E_terms * slope_size_;
    step_.slope_size = slope_size_ + AbsTimes(mode_.dynamics, x_size_);
  }
  step_.row_error.rounding *= kUlp;
  step_.row_error.truncation = InRows(mode_, sources_.f.error.truncation, sources_.g.error.truncation);
  step_.row_error.with_signs =
      mode_.is_explicit() ? sources_.f.error.with_signs : Vector(mode_.E * sources_.f.error.with_signs);
  if (mode_.source_g.size() > 0) step_.row_error.with_signs += mode_.source_g * sources_.g.error.with_signs;
}

void StepErrors::OfStates() {
  // The rounding error of a coefficient is less than so many times what one more correction changes.
  constexpr double kOfShown = 8;
  const auto is_stiff = solution_.stiffness.array() > ModeStepper::Solution::kForgets;
  // Rounding as the equations respond to it: with pseudo-random signs, which may cancel in a guard by chance, once more
  // with one sign, and, since both may cancel as the terms of a state do that is zero, with parts of the bounds.
  const Index m = x_size_.size();
  const Vector signs = SignsOfRounding(m), parts = PartsOfRounding(m);
  Matrix start(m, 3), source(m, 3);
  start << signs.cwiseProduct(x_size_), x_size_, parts.cwiseProduct(x_size_);
  source << signs.cwiseProduct(rows_size_), rows_size_, parts.cwiseProduct(rows_size_);
  constexpr Index kLooks = ModeStepper::kLooks;
  of_rounding_ = RoundingOf(kOperationsOfStep) * step_.stepper->RespondAtLooks(start, source);
  step_.rounding = StateRounding(m);
  Vector& own = step_.rounding.bound;
  own = RoundingOf(kOperationsOfStep) * x_size_ +
        RowMaxAbs(of_rounding_.leftCols(kLooks)).cwiseMax(RowMaxAbs(of_rounding_.rightCols(kLooks)));
  step_.rounding.samples.leftCols<2>() = of_rounding_(Eigen::all, Eigen::seqN(kLooks - 1, 2, kLooks));
  step_.x_error.rounding = is_stiff.select(own + magnitudes_.rounding.bound, own);
  // That is an upper bound, with which a stiff row may hide a boundary layer: what rounding there is shows.
  x_coefficients_ = kOfCoefficient * step_.x_error.rounding.cwiseProduct(solution_.stiffness.cwiseMax(1));
  // Of the rounding of the start only what it makes of fast states shows, and that of a row for as long as its own
  // equation keeps it.
  if (is_stiff.any()) {
    const Vector of_start =
        step_.stepper->LastOfStarts(magnitudes_.rounding.samples).cwiseMin(magnitudes_.rounding.bound);
    const Vector keeps = mode_.dynamics.diagonal().cwiseAbs().array() + 2 / sources_.length;
    const Vector of_rows = kUlp * step_.slope_size.cwiseQuotient(keeps);
    const Vector shown = kOfShown * (kUlp * x_size_ + of_rows + solution_.last_noise) + of_start;
    x_coefficients_ = is_stiff.select(x_coefficients_.cwiseMin(shown), x_coefficients_);
  }
  step_.x_tail = EstimateTail(step_.x, x_coefficients_);
  step_.x_hidden = RowMaxAbs(step_.x.rightCols<2>()).cwiseMin(x_coefficients_);
  const Vector unsettled = solution_.uncertainty + (solution_.kept_layer - x_coefficients_).cwiseMax(0);
  step_.x_error.truncation = step_.x_tail + unsettled;
  // A fast state starts where rounding of the others puts it, and settles.
  step_.x_unsettled = (unsettled + step_.layer).cwiseMin(own);
  if ((step_.row_error.truncation.array() != 0).any()) {
    Matrix missed(m, 2);
    missed << signs.cwiseProduct(step_.row_error.truncation), step_.row_error.with_signs;
    const Matrix response = step_.stepper->RespondAtLooks(Matrix::Zero(m, 2), missed);
    const SignedErrorBounds of_sources{{RowMaxAbs(response.leftCols(kLooks)), own},
                                       RowMaxAbs(response.rightCols(kLooks))};
    step_.x_error.truncation += of_sources.Truncation();
  }
  // They are zero whatever the triangular form makes of them.
  for (const Index i : step_.unreached)
    step_.x_tail[i] = step_.x_hidden[i] = step_.x_error.truncation[i] = step_.layer[i] = step_.x_unsettled[i] = 0;
}

void StepErrors::OfLinearRows(const LinearOutput& output, const Vector& lift, StepRows& rows) const {
  constexpr double kOfSlopes = 16;  // the noise of x' is that of single roundings
  rows.terms = Size(output, x_size_, slope_size_, sources_.f.size, sources_.g.size);
  Vector& rounding = rows.error.rounding;
  rounding = RoundingOf(kOperationsOfStep) * rows.terms;
  if (output.g.size() > 0) rounding += AbsTimes(output.g, sources_.g.error.rounding);
  if (output.f.size() > 0) rounding += AbsTimes(output.f, sources_.f.error.rounding);
  if (output.slope.size() > 0) {
    rows.source_slope_noise = AbsTimes(output.slope, solution_.source_slope_noise);
    rounding += kOfSlopes * AbsTimes(output.slope, solution_.slope_noise);
  }
  const Vector coefficients = kOfCoefficient * rounding + AbsTimes(output.state, x_coefficients_);
  // Where a row is a small difference of states, such as the voltage of a high resistance between inductors, what
  // rounding does to them mostly cancels.
  rounding +=
      RoundingOf(kOperationsOfStep) * AbsTimes(output.state, x_size_) + RowMaxAbs(Matrix(output.state * of_rounding_));
  if (solution_.IsStiff()) rounding += RowMaxAbs(Matrix(output.state * magnitudes_.rounding.samples));
  rows.tail = EstimateTail(rows.values, coefficients);
  // A slope misses Σ a_k P'_k over k > K, each of which is (2k + 1) P_{k-1} + (2k - 3) P_{k-3} + ...: k (k + 1)/2 a_k
  // at the ends, of which the decay of its coefficients shows the first term.
  if (output.slope.size() > 0) {
    const auto has_slope = (output.slope.array() != 0).rowwise().any().eval();
    rows.tail = has_slope.select((kLegendreDegree + 2) / 4.0 * rows.tail, rows.tail);
  }
  Vector of_sources = AbsTimes(output.g, sources_.g.error.truncation),
         with_signs = output.g * sources_.g.error.with_signs;
  if (output.f.size() > 0) {
    of_sources += AbsTimes(output.f, sources_.f.error.truncation);
    with_signs += output.f * sources_.f.error.with_signs;
  }
  if (output.slope_g.size() > 0) {
    // What the interpolant of g misses is (1 - s²) U_{K-1}(s), whose slope at the ends is 2K times its largest value.
    const double of_slopes = 4 * kLegendreDegree / sources_.length;
    of_sources += of_slopes * AbsTimes(output.slope_g, sources_.g.error.truncation);
    with_signs += of_slopes * (output.slope_g * sources_.g.error.with_signs);
  }
  const SignedErrorBounds of_polynomials{{of_sources, rounding}, with_signs};
  rows.error.truncation = rows.tail + lift.cwiseAbs() + of_polynomials.Truncation();
}

// The levels of the guards. `lift` as above; `gap` as in TakeSmoothStep().
Vector GuardLevels(const Mode& mode, const SmoothStep& step, const Vector& guard_size, double tolerance,
                   const EventGap* gap, const Vector& lift) {
  // A guard ends a mode where it falls below zero by this part of the tolerance, relative to its size on the step:
  // where modes accumulate, all sizes are small. A smaller violation is a negligible error.
  constexpr double kLevelPart = 1e-6;
  Vector levels =
      (kLevelPart * tolerance * guard_size).cwiseMax(4 * step.guard.error.rounding).cwiseMax(step.guard.tail);
  if (gap) {
    const Vector slope = mode.guard.slope.size() > 0 ? AbsTimes(mode.dynamics, gap->x) : Vector();
    levels += Size(mode.guard, gap->x, slope, gap->f, gap->g);
  }
  // A guard that a layer lifts from zero: at the start the polynomials already are what follows the layer.
  const Vector at_start = ValueOf(step.guard.values, LegendreValues(-1));
  for (Index i = 0; i < at_start.size(); ++i) {
    if (at_start[i] < -levels[i] && at_start[i] + lift[i] >= -levels[i]) levels[i] -= at_start[i];
  }
  return levels;
}

}  // namespace

Vector SlopeAt(const SmoothStep& step, const StepSources& sources, double s) {
  return 2 / sources.length * ValueOf(step.x, LegendreSlopes(LegendreValues(s)));
}

EventGap GapOf(const SmoothStep& step, const StepSources& sources) {
  return {step.x_tail, sources.f.error.truncation + EstimateTail(sources.f.values),
          sources.g.error.truncation + EstimateTail(sources.g.values)};
}

SmoothStep TakeSmoothStep(std::shared_ptr<const ModeStepper> stepper, const Eigen::Ref<const Vector>& start,
                          const StepSources& sources, const Magnitudes& magnitudes, double tolerance, double share,
                          const EventGap* gap) {
  const Mode& mode = stepper->mode();
  LegendreSeries b = mode.is_explicit() ? sources.f.values : Apply(mode.E, sources.f.values);
  if (mode.source_g.size() > 0) AddApplied(mode.source_g, sources.g.values, sources.g.is_steady, b);

  SmoothStep step;
  step.stepper = std::move(stepper);
  const Vector noise_of_sources = kOfNoise * InRows(mode, sources.f.error.rounding, sources.g.error.rounding);
  ModeStepper::SlopeOfSource slope;
  if (sources.g.is_steady && mode.num_algebraic > 0) {
    slope.values = LegendreSeries::Zero(mode.num_algebraic, kLegendreSize);
    slope.noise = Vector::Zero(mode.num_algebraic);
  } else if (sources.g.slope.rows() > 0 && mode.num_algebraic > 0) {
    slope.values = mode.algebraic_g() * sources.g.slope;
    slope.noise = AbsTimes(mode.algebraic_g(), sources.g.slope_rounding);
  }
  ModeStepper::Solution solution = step.stepper->Solve(start, b, noise_of_sources, slope);
  step.unreached = solution.unreached;
  step.left = std::move(solution.left);
  step.layer = 2 * solution.layer.cwiseAbs();
  step.y = Output(mode.y, solution, sources);
  step.guard.values = Output(mode.guard, solution, sources);
  if (mode.refinement) {
    mode.refinement->Refine(mode.active, solution.x, solution.slope, sources.f.values, sources.g.values, step.y);
    step.guard.values(mode.active, Eigen::all) = step.y(mode.active, Eigen::all);
  }
  if (mode.outputs.state.rows() > 0) step.outputs.values = Output(mode.outputs, solution, sources);
  step.x = std::move(solution.x);

  StepErrors errors(mode, sources, magnitudes, solution, step);
  errors.OfRows(RowMaxAbs(b) + 1 / kUlp * noise_of_sources);
  errors.OfStates();
  Eigen::VectorXcd slopes_of_layers;
  if (mode.guard.slope.size() > 0 && (solution.layer_parts.array() != 0.0).any()) {
    Matrix errors_of_start(start.size(), magnitudes.rounding.samples.cols() + magnitudes.errors.cols());
    errors_of_start << magnitudes.rounding.samples, magnitudes.errors;
    slopes_of_layers = step.stepper->SlopesOfLayers(solution.layer_parts, start, errors_of_start);
  }
  const auto lift_of = [&](const LinearOutput& output) -> Vector {
    Vector lift = 2 * output.state * solution.layer;
    if (slopes_of_layers.size() > 0 && output.slope.size() > 0)
      lift += output.slope * (mode.form.vectors * slopes_of_layers).real();
    return lift;
  };
  const Vector lift = lift_of(mode.guard);
  errors.OfLinearRows(mode.guard, lift, step.guard);
  if (mode.outputs.state.rows() > 0) {
    errors.OfLinearRows(mode.outputs, lift_of(mode.outputs), step.outputs);
    step.outputs.error.rounding += kUlp * AbsTimes(mode.outputs_of_y, SizeOfRows(step.y(mode.active, Eigen::all)));
  }
  step.x_size = errors.x_size();
  const Vector guard_size = SizeOfRows(step.guard.values);
  const Allowed allowed =
      AllowedErrors(mode, step, {errors.x_size(), guard_size}, {step.x_error.rounding, step.guard.error.rounding},
                    magnitudes, tolerance, share);
  step.error_ratio = ErrorRatio(step, allowed);
  step.guard_allowed = allowed.guard;
  if (step.error_ratio > 1) SetLayerLengths(mode, solution.layer_parts, slopes_of_layers, allowed, step);
  step.guard_level = GuardLevels(mode, step, guard_size, tolerance, gap, lift);
  return step;
}

Eigen::Matrix<double, kLegendreSize, 5> LooksBefore(double s) {
  Eigen::Matrix<double, kLegendreSize, 5> at;
  for (Index k = 0; k < at.cols(); ++k) {
    at.col(k) = LegendreValues(-1 + (1 + s) * static_cast<double>(k) / static_cast<double>(at.cols() - 1));
  }
  return at;
}

void LimitSizes(const StepSources& sources, double s, SmoothStep& step) {
  const Mode& mode = step.stepper->mode();
  const auto at = LooksBefore(s);
  const auto before = [&at](const LegendreSeries& series) { return RowMaxAbs(Matrix(series.lazyProduct(at))); };
  const Vector x = before(step.x), f = before(sources.f.values), g = before(sources.g.values);
  Vector slope;
  if (!mode.is_explicit()) slope = before(2 / sources.length * DerivativeOf(step.x));
  const auto limit = [](const Vector& size, Vector& limited) { limited = limited.cwiseMin(size); };
  Vector rows =
      mode.F_terms * x + InRows(mode, f + sources.f.error.rounding / kUlp, g + sources.g.error.rounding / kUlp);
  if (!mode.is_explicit()) rows += mode.E_terms * slope;
  limit(kUlp * rows, step.row_error.rounding);
  limit(mode.is_explicit() ? rows : Vector(slope + AbsTimes(mode.dynamics, x)), step.slope_size);
  limit(x, step.x_size);
  limit(Size(mode.guard, x, slope, f, g), step.guard.terms);
  if (step.outputs.terms.size() > 0) limit(Size(mode.outputs, x, slope, f, g), step.outputs.terms);
}

double ErrorRatioBefore(double s, const Mode& mode, const SmoothStep& step, const Magnitudes& magnitudes,
                        double tolerance, double share) {
  const auto at = LooksBefore(s);
  const StatesAndGuards size{RowMaxAbs(Matrix(step.x.lazyProduct(at))),
                             RowMaxAbs(Matrix(step.guard.values.lazyProduct(at)))};
  // Behind s they may grow, and their rounding with them.
  const auto before = [](const Vector& noise, const Vector& part, const LegendreSeries& series) {
    const Vector whole = SizeOfRows(series);
    return Vector((part.array() < whole.array()).select(noise.cwiseProduct(part).cwiseQuotient(whole), noise));
  };
  const StatesAndGuards noise{before(step.x_error.rounding, size.x.cwiseMax(magnitudes.x), step.x),
                              before(step.guard.error.rounding, size.guard, step.guard.values)};
  // What polynomials are evaluated from is rounded, however small they are before s.
  const Allowed of_values = AllowedErrors(mode, step, size, noise, magnitudes, tolerance, share, 0);
  const double ratio_of_values = NanMax(LargestRatio(kUlp * SizeOfRows(step.x), of_values.layer),
                                        LargestRatio(kUlp * SizeOfRows(step.guard.values), of_values.guard));
  const Allowed allowed = AllowedErrors(mode, step, size, noise, magnitudes, tolerance, share);
  return NanMax(ErrorRatio(step, allowed), ratio_of_values);
}

bool Project(const Mode& mode, const StepSources& sources, double tolerance, Magnitudes& magnitudes, Vector& x) {
  if (mode.num_algebraic == 0) return true;
  const Vector g = ValueOf(sources.g.values, LegendreValues(-1));
  const Matrix of_g = mode.algebraic_g();
  const Vector residual = mode.algebraic_rows() * x + of_g * g;
  const Vector size = mode.algebraic_rows().cwiseAbs() * x.cwiseAbs() + of_g.cwiseAbs() * g.cwiseAbs();
  // Nothing is known of a residual that is not larger.
  const Vector rounding = RoundingOf(kOperationsOfStep) * size + of_g.cwiseAbs() * sources.g.error.rounding;
  const Vector change = mode.correction * residual;
  StateRounding& of_state = magnitudes.rounding;
  if ((residual.array().abs() <= rounding.array()).all()) {
    // Where rounding moves slow states off a constraint, fast states make up for it at once.
    of_state.bound = of_state.bound.cwiseMax(change.cwiseAbs());
    of_state.samples.col(2) = change;
    return true;
  }
  // What the states are off by in the residual moves all that the correction moves, one that is zero so far too.
  const Vector known = rounding + mode.algebraic_rows().cwiseAbs() * of_state.bound;
  const Vector allowed = tolerance * magnitudes.x + (mode.correction.cwiseAbs() * known).cwiseMax(of_state.bound);
  if ((change.array().abs() > allowed.array()).any()) return false;
  x -= change;
  of_state.bound += change.cwiseAbs().cwiseMin(mode.correction.cwiseAbs() * rounding);
  return true;
}

}  // namespace dlcs
