// SPDX-License-Identifier: Apache-2.0
#include "core/event_driven/error_growth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/event_driven/step_length.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// The time of an event has the rounding of so many operations at best.
constexpr Index kOperationsOfTime = 32;
// Of a linear function.
constexpr Index kOperationsOfRow = 8;

// What remains of each of the errors beyond what a shift in time by `shifts` makes of a function of this slope.
void Shrink(const Vector& slope, const Eigen::RowVectorXd& shifts, Matrix& errors) {
  for (Index e = 0; e < errors.cols(); ++e) {
    for (Index i = 0; i < errors.rows(); ++i) {
      const double left = NanMax(0, std::abs(errors(i, e)) - shifts[e] * std::abs(slope[i]));
      errors(i, e) = std::copysign(left, errors(i, e));
    }
  }
}

// How much later a guard vanishes that is larger by `error` than one that vanishes with this slope and second
// derivative. If it does not vanish at all, the event may be missed, or the next one may come as early: up to where the
// guard turns.
double DelayOf(double error, double speed, double curvature) {
  const double squared = speed * speed - 2 * curvature * error;
  return squared >= 0 ? 2 * error / (std::copysign(std::sqrt(squared), -speed) - speed) : -speed / curvature;
}

// w of a step at `s`.
Vector SlacksAt(const SmoothStep& step, const LegendreVector& at) {
  Vector w = ValueOf(step.guard.values, at);
  for (const Index i : step.stepper->mode().active) w[i] = 0;
  return w;
}

// How far the polynomial x of a step moves in `time` from position s on, as a line beyond its end.
Vector Moved(const LegendreSeries& x, double length, double s, double time) {
  const double inside = std::min(time, (1 - s) / 2 * length);
  Vector moved = ValueOf(x, LegendreValues(std::min(1.0, s + 2 * inside / length)) - LegendreValues(s));
  if (inside < time) {
    moved += (time - inside) * (2 / length) * ValueOf(x, LegendreSlopes(LegendreValues(1)));
  }
  return moved;
}

void Raise(SignedErrorBounds& bounds, Index i, double truncation, double with_signs, double rounding) {
  bounds.truncation[i] = NanMax(bounds.truncation[i], truncation);
  bounds.with_signs[i] = NanMax(bounds.with_signs[i], with_signs);
  bounds.rounding[i] = NanMax(bounds.rounding[i], rounding);
}

}  // namespace

ErrorGrowth::ErrorGrowth(const Problem& problem)
    : problem_(problem),
      errors_(problem.x0),
      shifts_(Eigen::RowVectorXd::Zero(SampledErrors::kCount)),
      x_(SignedErrorBounds::Zero(problem.num_states())),
      y_(SignedErrorBounds::Zero(problem.num_constraints())),
      w_(SignedErrorBounds::Zero(problem.num_constraints())),
      outputs_(SignedErrorBounds::Zero(problem.outputs.shown())),
      overlooked_y_(Vector::Zero(problem.num_constraints())),
      hidden_y_(overlooked_y_) {}

double ErrorGrowth::AddStep(const SmoothStep& step, const StepSources& sources, const OverlookedByCause& overlooked,
                            double s_end, std::optional<Index> guard) {
  errors_.BeginStep();
  Pass(step, sources);
  errors_.Propagate(step, overlooked, s_end);
  const Mode& mode = step.stepper->mode();
  // What the refinement left is the rounding inside of the step, and a coefficient that is taken for rounding counts as
  // rounding. Of a step that an event cuts both are those of what may grow behind the event, and what counts is the
  // rounding of the polynomials.
  Matrix left_inside;
  Vector inside = step.x_unsettled;
  // The rounding of a row is another one at each time, and so not what the samples make of one that stays. Its state
  // keeps it for as long as its own equation does.
  if (mode.is_explicit()) {
    inside += step.row_error.rounding.cwiseQuotient(Vector(mode.F.diagonal().cwiseAbs().array() + 2 / sources.length));
  }
  if (s_end == 1) {
    left_inside = step.left.lazyProduct(LooksBefore(s_end));
    inside += RowMaxAbs(left_inside) + step.x_hidden;
  } else {
    inside += kUlp * SizeOfRows(step.x);
  }
  const double end = sources.begin + (1 + s_end) / 2 * sources.length;
  // What a shift by the error of the time of an event explains near it is no error. An error that stays is counted on
  // another step.
  Eigen::RowVectorXd shifts = Eigen::RowVectorXd::Zero(SampledErrors::kCount);
  if (end - last_event_ <= kNear * end) shifts = shifts_;
  double time_error = 0;
  if (guard) {
    time_error = BeginEvent(step, sources, s_end, *guard);
    if (end - sources.begin <= kNear * end) {
      for (Index e = 0; e < SampledErrors::kCount; ++e) shifts[e] = std::max(shifts[e], std::abs(event_.delay[e]));
    }
  }
  const LegendreVector slope_at = 2 / sources.length * LegendreSlopes(LegendreValues(s_end));
  Matrix unexcused = errors_.values();
  Shrink(ValueOf(step.x, slope_at), shifts, unexcused);
  const SignedErrorBounds at_end = SampledErrors::SizesOf(unexcused);
  for (Index i = 0; i < inside.size(); ++i) {
    const double own = step.x_error.truncation[i] + step.layer[i] - step.x_unsettled[i];
    Raise(x_, i, at_end.truncation[i] + own, at_end.with_signs[i] + own, at_end.rounding[i] + inside[i]);
  }
  RaiseOutputs(step, slope_at, shifts, overlooked, left_inside);
  return time_error;
}

void ErrorGrowth::AddBreak(const SmoothStep& step, const StepSources& sources, double rounding) {
  if (has_event_) return;  // at the same time
  BeginJump(step, sources, 1);
  event_.is_break = true;
  event_.delay.fill(0);
  for (Index e = 0; e < SampledErrors::kOfRounding; ++e) event_.delay[e] = rounding;
}

// The errors of the state when the delay began are what they are of its end: with their signs both may cancel.
void ErrorGrowth::AddEndOfDelay(const SmoothStep& step, const StepSources& sources, const TimeErrors& errors_of_time) {
  BeginJump(step, sources, 1);
  event_.delay = errors_of_time;
}

double ErrorGrowth::SizeOf(const TimeErrors& errors_of_time) {
  const SignedErrorBounds sizes = BoundsOf(errors_of_time);
  return sizes.Truncation()[0] + sizes.rounding[0];
}

void ErrorGrowth::BeginJump(const SmoothStep& step, const StepSources& sources, double s) {
  event_.x = step.x;
  event_.length = sources.length;
  event_.s = s;
  event_.is_break = false;
  event_.slope = SlopeAt(step, sources, s);
  const LegendreVector at = LegendreValues(s);
  event_.y = ValueOf(step.y, at);
  event_.w = SlacksAt(step, at);
  event_.outputs = ValueOf(step.outputs.values, at);
  has_event_ = true;
}

SignedErrorBounds ErrorGrowth::BoundsOf(const TimeErrors& errors_of_time) {
  return SampledErrors::SizesOf(
      Eigen::Map<const Eigen::Matrix<double, 1, SampledErrors::kCount>>(errors_of_time.data()));
}

// Keeps the event until x' after it is known. Returns how far its time may be off.
double ErrorGrowth::BeginEvent(const SmoothStep& step, const StepSources& sources, double s_end, Index guard) {
  const Mode& mode = step.stepper->mode();
  const LegendreVector slope_at = 2 / sources.length * LegendreSlopes(LegendreValues(s_end));
  const LegendreVector series = step.guard.values.row(guard).transpose();
  const double speed = series.dot(slope_at);
  const double curvature = 2 / sources.length * DerivativeOf(series).dot(slope_at);
  BeginJump(step, sources, s_end);
  const double part_of_tail = mode.guard.slope.size() > 0 ? 1 : PartOfTail(s_end);
  // Where the guard was found below zero and not at a zero, the event was before, maybe in another step.
  const double of_terms = RoundingOf(kOperationsOfRow) * step.guard.terms[guard];
  const double depth = std::max(0.0, -series.dot(LegendreValues(s_end)) - of_terms);
  const double late = std::min(depth / std::abs(speed), sources.begin + sources.length);
  const double late_by_rounding = late * std::min(1.0, step.guard.error.rounding[guard] / depth);
  for (Index e = 0; e < SampledErrors::kCount; ++e) {
    const double moved = errors_.In(mode.guard, guard, e);
    const double own = e < SampledErrors::kOfRounding ? of_terms : part_of_tail * step.guard.tail[guard];
    // If a guard neither falls nor turns, nothing is known of it.
    const double delay = DelayOf(moved + std::copysign(own, moved), speed, curvature);
    event_.delay[e] = std::isnan(delay) ? 0 : std::clamp(delay, -sources.length, sources.length);
    if (depth > 0)
      event_.delay[e] +=
          std::copysign(e < SampledErrors::kOfRounding ? late_by_rounding : late - late_by_rounding, delay);
  }
  return SizeOf(event_.delay);
}

// Between the true time of the event and the one that was found the state went on as before instead of as after it. How
// much that is by the jump of x', and by the polynomials on both sides: the first is too much where a fast state
// settles in less time, the second where a fast state that the event does not concern bends. The smaller one counts.
// The time of a break point may be off to either side: the samples have the signs of rounding. If a time is off by more
// than the rounding of times, there are times to ask for in between, at which fast states are off before they settle.
void ErrorGrowth::Pass(const SmoothStep& step, const StepSources& sources) {
  if (!has_event_) return;
  has_event_ = false;
  last_event_ = sources.begin;
  const double rounding_of_time = RoundingOf(kOperationsOfTime) * sources.begin;
  for (Index e = 0; e < SampledErrors::kCount; ++e) shifts_[e] = std::max(rounding_of_time, std::abs(event_.delay[e]));
  RaiseJumps(step);
  const Vector slope_jump = event_.slope - SlopeAt(step, sources, -1);
  const auto jump_within = [&](double delay) {
    Vector jump = Moved(event_.x, event_.length, event_.s, delay) - Moved(step.x, sources.length, -1, delay);
    for (Index i = 0; i < jump.size(); ++i) {
      const double linear = delay * slope_jump[i];
      if (std::abs(linear) < std::abs(jump[i])) jump[i] = linear;
    }
    return jump;
  };
  if (!event_.is_break) {
    for (Index e = 0; e < SampledErrors::kCount; ++e) {
      errors_.Add(e, std::copysign(1, event_.delay[e]) * jump_within(std::abs(event_.delay[e])));
    }
    if (Delays().Truncation()[0] > rounding_of_time) RaiseSoonAfter(step);
    return;
  }
  const double delay = event_.delay[0];
  const Vector jump = jump_within(delay);
  errors_.AddRoundingOfOneSign(jump, step.x_size);
  if (!(delay > rounding_of_time)) return;
  for (Index i = 0; i < jump.size(); ++i) Raise(x_, i, 0, 0, std::abs(jump[i]));
}

// Where fast states settle after an event, x, y, w and outputs are off by more than at the end of the step. What
// rounding makes of them there is no more than the rounding of the time explains.
void ErrorGrowth::RaiseSoonAfter(const SmoothStep& step) {
  // A step that resolves a fast state is some eight of its times long: this is 0.4 of them after the event.
  constexpr double kSoon = -0.9;
  const Mode& mode = step.stepper->mode();
  const SampledErrors soon = errors_.Inside(step, kSoon);
  const auto raise = [](const SignedErrorBounds& errors, Index i, SignedErrorBounds& of) {
    const double rounding = errors.rounding[i];
    Raise(of, i, NanMax(0, errors.truncation[i] - rounding), NanMax(0, errors.with_signs[i] - rounding), 0);
  };
  const SignedErrorBounds states = SampledErrors::SizesOf(soon.values());
  for (Index i = 0; i < states.rounding.size(); ++i) raise(states, i, x_);
  const SignedErrorBounds guards = SampledErrors::SizesOf(soon.In(mode.guard));
  for (Index i = 0; i < guards.rounding.size(); ++i) {
    raise(guards, i, std::binary_search(mode.active.begin(), mode.active.end(), i) ? y_ : w_);
  }
  if (outputs_.rounding.size() == 0) return;
  const SignedErrorBounds outputs = SampledErrors::SizesOf(soon.In(mode.outputs));
  for (Index i = 0; i < outputs.rounding.size(); ++i) raise(outputs, i, outputs_);
}

// Beside a jump both limits are right within the error of its time. Elsewhere, and in integrals, what counts is
// (z⁻ - z⁺) δt, here of the integral over [0, T].
void ErrorGrowth::RaiseJumps(const SmoothStep& step) {
  const LegendreVector at = LegendreValues(-1);
  const SignedErrorBounds delays = Delays();
  const double truncation = delays.truncation[0] / problem_.horizon, rounding = delays.rounding[0] / problem_.horizon;
  const double with_signs = delays.with_signs[0] / problem_.horizon;
  const auto raise = [&](const Vector& before, const Vector& after, SignedErrorBounds& of) {
    for (Index i = 0; i < before.size(); ++i) {
      const double jump = std::abs(after[i] - before[i]);
      Raise(of, i, truncation * jump, with_signs * jump, rounding * jump);
    }
  };
  raise(event_.y, ValueOf(step.y, at), y_);
  raise(event_.w, SlacksAt(step, at), w_);
  raise(event_.outputs, ValueOf(step.outputs.values, at), outputs_);
}

void ErrorGrowth::Add(const Vector& error, const Vector& inside) {
  has_event_ = false;
  errors_.BeginStep();
  errors_.AddTruncation(error);
  const SignedErrorBounds at_end = SampledErrors::SizesOf(errors_.values());
  for (Index i = 0; i < error.size(); ++i) {
    Raise(x_, i, at_end.truncation[i] + inside[i], at_end.with_signs[i] + inside[i], at_end.rounding[i]);
  }
}

void ErrorGrowth::AddInside(const Vector& of_w) {
  for (Index i = 0; i < of_w.size(); ++i) Raise(w_, i, of_w[i], of_w[i], 0);
}

void ErrorGrowth::Reset(const Matrix& J, const Vector& amount) {
  errors_.Reset(J);
  errors_.AddRounding(amount);
  if (!has_event_) return;
  event_.x = J * event_.x;
  event_.slope = J * event_.slope;
}

ErrorBounds ErrorGrowth::InGuards(const Mode& mode) const {
  const SignedErrorBounds sizes = SampledErrors::SizesOf(mode.guard.state * errors_.values());
  return {sizes.Truncation(), sizes.rounding};
}

Vector ErrorGrowth::InState() const {
  const SignedErrorBounds sizes = SampledErrors::SizesOf(errors_.values());
  return sizes.truncation + sizes.rounding;
}

void ErrorGrowth::RaiseOutputs(const SmoothStep& step, const LegendreVector& slope_at, const Eigen::RowVectorXd& shifts,
                               const OverlookedByCause& overlooked, const Matrix& left_inside) {
  const Mode& mode = step.stepper->mode();
  const SignedErrorBounds guards = InRows(mode.guard, step.guard, slope_at, shifts, left_inside);
  const Index n = guards.rounding.size();
  std::vector<bool> is_active(static_cast<std::size_t>(n));
  for (const Index i : mode.active) is_active[static_cast<std::size_t>(i)] = true;
  for (Index i = 0; i < n; ++i) {
    SignedErrorBounds& of = is_active[static_cast<std::size_t>(i)] ? y_ : w_;
    Raise(of, i, guards.truncation[i], guards.with_signs[i], guards.rounding[i]);
    const double dip = overlooked.truncation.y[i], of_w = overlooked.truncation.w[i];
    Raise(w_, i, of_w, of_w, overlooked.rounding.w[i]);
    Raise(y_, i, dip, dip, overlooked.rounding.y[i]);
  }
  overlooked_y_ = overlooked_y_.cwiseMax(overlooked.y_size);
  hidden_y_ = hidden_y_.cwiseMax(overlooked.y_hidden);
  if (outputs_.rounding.size() == 0) return;
  const SignedErrorBounds outputs = InRows(mode.outputs, step.outputs, slope_at, shifts, left_inside);
  const Vector dips = problem_.outputs.D.AbsTimes(overlooked.truncation.y);
  const Vector of_rounding = problem_.outputs.D.AbsTimes(overlooked.rounding.y);
  for (Index i = 0; i < outputs.rounding.size(); ++i) {
    Raise(outputs_, i, outputs.truncation[i] + dips[i], outputs.with_signs[i] + dips[i],
          outputs.rounding[i] + of_rounding[i]);
  }
}

// The errors of linear functions of the solution at the end of the step, and their own.
SignedErrorBounds ErrorGrowth::InRows(const LinearOutput& output, const StepRows& rows, const LegendreVector& slope_at,
                                      const Eigen::RowVectorXd& shifts, const Matrix& left_inside) const {
  Matrix of_x = errors_.In(output);
  Shrink(ValueOf(rows.values, slope_at), shifts, of_x);
  SignedErrorBounds errors = SampledErrors::SizesOf(of_x);
  errors.truncation += rows.error.truncation;
  errors.with_signs += rows.error.truncation;
  errors.rounding += RoundingOf(kOperationsOfRow) * rows.terms;
  if (left_inside.size() > 0) {
    errors.rounding += RowMaxAbs(Matrix(output.state * left_inside));
  } else {
    errors.rounding += kUlp * SizeOfRows(rows.values);
  }
  if (rows.source_slope_noise.size() > 0) errors.rounding += kOfNoise * rows.source_slope_noise;
  return errors;
}

TrajectoryErrors ErrorGrowth::Errors(const Magnitudes& sizes) const {
  // Errors beyond the range of doubles have no difference.
  const auto bounded = [](const Vector& errors) {
    return Vector(errors.array().isNaN().select(std::numeric_limits<double>::infinity(), errors));
  };
  const auto by_cause = [&](const Vector& own, SignedErrorBounds errors) {
    errors.rounding += kUlp * own;  // what is stored is rounded
    return ErrorsByCause{own, bounded(errors.Truncation()), bounded(errors.rounding)};
  };
  // A y_i that was always zero has the size of what may be missing of it.
  const Vector missing = (overlooked_y_.array() > hidden_y_.array()).select(overlooked_y_, 0);
  const Vector y_sizes = (sizes.y.array() == 0).select(missing, sizes.y);
  TrajectoryErrors errors{by_cause(sizes.x, x_), by_cause(y_sizes, y_), by_cause(sizes.w, w_),
                          by_cause(sizes.outputs, outputs_)};
  // All that there is of a y_i that was always zero is what rounding hides of it.
  for (Index i = 0; i < y_sizes.size(); ++i) {
    if (sizes.y[i] == 0) errors.y.rounding[i] = NanMax(errors.y.rounding[i], hidden_y_[i]);
  }
  // y_i and w_i are the two sides of one number, of which one that is always zero has an ulp, as w_i has of N x. Where
  // both are, that ulp decides which of them is zero. What is exactly zero remains so.
  for (Index i = 0; i < sizes.y.size(); ++i) {
    const double M = std::max(0.0, problem_.M.Dense()(i, i));
    const double of_terms = kUlp * problem_.N.Dense().row(i).cwiseAbs().dot(sizes.x);
    const bool are_zero = sizes.y[i] == 0 && sizes.w[i] == 0;
    if (M > 0 && sizes.y[i] == 0 && (are_zero || errors.y.truncation[i] > 0))
      errors.y.rounding[i] += (are_zero ? of_terms : kUlp * sizes.w[i]) / M;
    if (sizes.w[i] == 0 && (are_zero || errors.w.truncation[i] > 0))
      errors.w.rounding[i] += kUlp * sizes.y[i] * M + of_terms;
  }
  return errors;
}

}  // namespace dlcs
