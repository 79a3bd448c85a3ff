// SPDX-License-Identifier: Apache-2.0
#include "core/event_driven/error_growth.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <utility>

#include "core/linalg/abs_times.h"
#include "core/linalg/norms.h"
#include "core/linalg/weyl_sequence.h"

namespace dlcs {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// The integral of what an interpolant misses is smaller than that is, since it has the signs of a polynomial of high
// degree.
constexpr double kOfMissed = 0.25;

// Times are known to so many ulps: what a shift by them explains right after an event is no error, and a fast state
// that settles anew is off by as much until it has settled. An error that stays is counted later.
constexpr double kRoundingOfTime = 16 * kEpsilon;
constexpr double kRightAfter = 1e-4;  // part of the time of the event

// What remains of each row of `errors` beyond `excused`, towards zero.
void Shrink(const Vector& excused, Matrix& errors) {
  for (Index e = 0; e < errors.cols(); ++e) {
    for (Index i = 0; i < errors.rows(); ++i) {
      errors(i, e) = std::copysign(NanMax(0, std::abs(errors(i, e)) - excused[i]), errors(i, e));
    }
  }
}

// The signs of `error`, and those of `otherwise` where it is zero.
Vector SignsLike(const Eigen::Ref<const Vector>& error, Vector otherwise) {
  for (Index i = 0; i < error.size(); ++i) {
    if (error[i] != 0) otherwise[i] = std::copysign(1, error[i]);
  }
  return otherwise;
}

// Rounding errors of rows: parts, between a half and one, of their bounds, with signs. A fast state may be the same
// multiple of the bounds in all rows: by signs alone, what is left of them in slow states may cancel to nothing.
Vector PartsOfRounding(Index size, unsigned seed) {
  Vector parts = SignsOfRounding(size, seed);
  for (Index i = 0; i < size; ++i) {
    parts[i] *= 0.5 + 0.5 * WeylValue(static_cast<double>(i) + 1 + seed);
  }
  return parts;
}

// The signs with which errors of the given sizes add most to what lasts longest of `error`, in the rows that matter to
// it; `otherwise` in the others.
Vector SignsThatLast(const Eigen::VectorXcd& slowest, const Vector& sizes, const Vector& error, Vector otherwise) {
  constexpr double kMatters = 1e-3;
  const std::complex<double> lasts = slowest.cwiseProduct(error).sum();
  const Eigen::VectorXcd turned = lasts == 0.0 ? slowest : Eigen::VectorXcd(std::conj(lasts) * slowest);
  const Vector parts = turned.real().cwiseProduct(sizes);
  const double matters = kMatters * MaxAbs(parts);
  for (Index i = 0; i < parts.size(); ++i) {
    if (std::abs(parts[i]) > matters) otherwise[i] = std::copysign(1, parts[i]);
  }
  return otherwise;
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

}  // namespace

ErrorGrowth::ErrorGrowth(const Problem& problem, bool y_counts)
    : problem_(problem),
      errors_(problem.num_states(), kErrors),
      x_(Vector::Zero(problem.num_states())),
      noise_(x_),
      By_(Vector::Zero(y_counts ? problem.num_states() : 0)),
      w_(Vector::Zero(y_counts ? problem.num_constraints() : 0)) {
  const Vector& x0 = problem.x0;
  for (Index e = 0; e < kErrors; ++e) {
    errors_.col(e) = kEpsilon * SignsOfRounding(x0.size(), static_cast<unsigned>(e)).cwiseProduct(x0);
  }
}

Vector ErrorGrowth::Signs(Index error, const Eigen::Ref<const Vector>& values) const {
  const Index size = errors_.rows();
  if (error == 1) return SignsOfRounding(size, 1);
  if (error > 1) return SignsOfRounding(size, 2 + steps_);
  return SignsLike(values, SignsOfRounding(size, 0));
}

void ErrorGrowth::AddTo(Index error, const Vector& amount) {
  errors_.col(error) += Signs(error, errors_.col(error)).cwiseProduct(amount);
}

void ErrorGrowth::AddStep(const SmoothStep& step, const StepSources& sources, const Overlooked& overlooked,
                          double s_end) {
  ++steps_;
  Pass(step, sources);
  const LegendreVector at = LegendreValues(s_end);
  const Vector rounding = kEpsilon * step.x.cwiseAbs().rowwise().sum();
  const Mode& mode = step.stepper->mode();
  const Vector missed =
      kOfMissed * step.row_error + (mode.is_explicit() ? overlooked.slope : AbsTimes(mode.E, overlooked.slope));
  Matrix rows(rounding.size(), kErrors);
  for (Index e = 0; e < kErrors; ++e) {
    // What an ulp of the data is stays the same. For the last error it has the signs that add to it: a system with slow
    // and fast states forgets most errors, and signs at hand may all be of that kind.
    const auto seed = static_cast<unsigned>(e);
    Vector of_data = PartsOfRounding(rounding.size(), seed);
    const auto error = errors_.col(e);
    const Vector in_rows = mode.is_explicit() ? Vector(error) : Vector(mode.E * error);
    if (e + 1 == kErrors) of_data = SignsThatLast(mode.slowest, step.row_noise, in_rows, SignsLike(in_rows, of_data));
    rows.col(e) = of_data.cwiseProduct(step.row_noise) + Signs(e, in_rows).cwiseProduct(missed);
  }
  ModeStepper::Response response = step.stepper->RespondAt(s_end, errors_, rows);
  errors_ = std::move(response.values);
  slopes_ = std::move(response.slopes);
  // In the triangular form they have the rounding of others.
  for (const Index i : step.unreached) {
    errors_.row(i).setZero();
    slopes_.row(i).setZero();
  }
  for (Index e = 0; e < kErrors; ++e) {
    errors_.col(e) +=
        SignsOfRounding(rounding.size(), kErrors * steps_ + static_cast<unsigned>(e)).cwiseProduct(rounding);
    // At its end a step is far better than inside of it, where an event cuts it.
    AddTo(e, s_end < 1 ? Vector(overlooked.x + step.x_tail) : overlooked.x);
  }
  const double end = sources.begin + (1 + s_end) / 2 * sources.length;
  LegendreVector shift = LegendreVector::Zero();
  if (end - last_event_ <= kRightAfter * end) {
    shift = kRoundingOfTime * end * 2 / sources.length * LegendreSlopes(at);
  }
  Matrix unexcused = errors_;
  Shrink(ValueOf(step.x, shift).cwiseAbs(), unexcused);
  Raise(unexcused, step.x_error + step.layer);
  RaiseOutputs(step, shift, overlooked.y);
  noise_ = noise_.cwiseMax(step.x_noise);
}

void ErrorGrowth::AddEvent(const Mode& mode, const SmoothStep& step, const StepSources& sources, double s_end,
                           Index guard) {
  const LegendreVector slope_at = 2 / sources.length * LegendreSlopes(LegendreValues(s_end));
  const double speed = step.guard.row(guard).dot(slope_at);
  event_.x = step.x;
  event_.length = sources.length;
  event_.s = s_end;
  event_.slope = SlopeAt(step, sources, s_end);
  has_event_ = true;
  for (Index e = 0; e < kErrors; ++e) {
    double moved = mode.guard.state.row(guard).dot(errors_.col(e));
    if (mode.guard.slope.size() > 0) moved += mode.guard.slope.row(guard).dot(slopes_.col(e));
    const double delay = -(moved + std::copysign(step.guard_tail[guard], moved)) / speed;
    // If a guard only touches zero, its speed is useless.
    event_.delay[e] = std::isnan(delay) ? 0 : std::clamp(delay, -sources.length, sources.length);
  }
}

// Between the true time of the event and the one that was found the state went on as before instead of as after it. How
// much that is by the jump of x', and by the polynomials on both sides: the first is too much where a fast state
// settles in less time, the second where a fast state that the event does not concern bends. The smaller one counts.
void ErrorGrowth::Pass(const SmoothStep& step, const StepSources& sources) {
  constexpr double kSame = 1e-6;
  if (!has_event_) return;
  has_event_ = false;
  last_event_ = sources.begin;
  const Vector slope_jump = event_.slope - SlopeAt(step, sources, -1);
  const Vector size = event_.slope.cwiseAbs() + step.slope_size;
  for (Index e = 0; e < kErrors; ++e) {
    const double delay = std::abs(event_.delay[e]);
    Vector jump = Moved(event_.x, event_.length, event_.s, delay) - Moved(step.x, sources.length, -1, delay);
    for (Index i = 0; i < jump.size(); ++i) {
      const double linear = delay * slope_jump[i];
      if (std::abs(linear) < std::abs(jump[i])) jump[i] = linear;
      if (std::abs(jump[i]) <= kSame * delay * size[i]) jump[i] = 0;
    }
    errors_.col(e) += std::copysign(1, event_.delay[e]) * jump;
  }
}

Vector ErrorGrowth::Unexplained(const Vector& change) const {
  return (change.cwiseAbs() - RowMaxAbs(errors_)).cwiseMax(0);
}

void ErrorGrowth::AddMissed(const Vector& amount) {
  for (Index e = 0; e < kErrors; ++e) AddTo(e, amount);
}

void ErrorGrowth::Add(const Vector& error, const Vector& inside) {
  has_event_ = false;
  ++steps_;
  AddMissed(error);
  Raise(errors_, inside);
}

void ErrorGrowth::Raise(const Matrix& errors, const Vector& within) {
  for (Index i = 0; i < x_.size(); ++i) x_[i] = NanMax(x_[i], MaxAbs(errors.row(i)) + within[i]);
}

Vector ErrorGrowth::InGuards(const Mode& mode) const { return RowMaxAbs(Matrix(mode.guard.state * errors_)); }

void ErrorGrowth::RaiseOutputs(const SmoothStep& step, const LegendreVector& shift, const Vector& overlooked_y) {
  constexpr double kRounding = 4 * kEpsilon;
  if (w_.size() == 0) return;
  const Mode& mode = step.stepper->mode();
  Matrix of_x = mode.guard.state * errors_;
  if (mode.guard.slope.size() > 0) of_x += mode.guard.slope * slopes_;
  Shrink(ValueOf(step.guard, shift).cwiseAbs(), of_x);
  const Vector own = step.guard_error + kRounding * step.guard_terms;
  std::vector<bool> is_active(static_cast<std::size_t>(w_.size()));
  for (const Index i : mode.active) is_active[static_cast<std::size_t>(i)] = true;
  Vector of_y = Vector::Zero(own.size());
  for (Index i = 0; i < own.size(); ++i) {
    if (is_active[static_cast<std::size_t>(i)]) {
      of_y[i] = own[i];
    } else {
      w_[i] = NanMax(w_[i], MaxAbs(of_x.row(i)) + own[i]);
      of_x.row(i).setZero();
      of_y[i] = overlooked_y[i];
    }
  }
  const Vector By = RowMaxAbs(problem_.B * of_x) + problem_.B.AbsTimes(of_y);
  for (Index i = 0; i < By.size(); ++i) By_[i] = NanMax(By_[i], By[i]);
}

ComponentErrors ErrorGrowth::RelativeTo(const Magnitudes& sizes, std::vector<Index>& small_but_known) const {
  constexpr double kOfError = 4;  // an estimate is ten times the error or so
  // Errors beyond the range of doubles have no difference.
  const auto bounded = [](const Vector& errors) {
    constexpr double kInfinite = std::numeric_limits<double>::infinity();
    return Vector(errors.array().isNaN().select(kInfinite, errors));
  };
  for (Index i = 0; i < x_.size(); ++i) {
    if (!(sizes.x[i] <= noise_[i] && x_[i] < kOfError * sizes.x[i])) continue;
    // An earlier solve may have listed it.
    const auto place = std::lower_bound(small_but_known.begin(), small_but_known.end(), i);
    if (place == small_but_known.end() || *place != i) small_but_known.insert(place, i);
  }
  ComponentErrors errors{.x = bounded(Relative(x_, sizes.x, noise_))};
  for (const Index i : small_but_known) {
    if (sizes.x[i] <= noise_[i]) errors.x[i] = sizes.x[i] > 0 ? x_[i] / sizes.x[i] : 0;
  }
  if (w_.size() == 0) return errors;
  constexpr double kRounding = 16 * kEpsilon;
  const Vector terms_of_w = problem_.N.AbsTimes(sizes.x) + problem_.M.AbsTimes(sizes.y) + sizes.g;
  // An active y_i is a sum of the terms of w_i, divided by M_ii.
  const Vector diagonal = problem_.M.Dense().diagonal();
  const Vector terms_of_y = (diagonal.array() > 0).select(terms_of_w.cwiseQuotient(diagonal), sizes.y);
  errors.By = bounded(Relative(By_, sizes.By, kRounding * problem_.B.AbsTimes(terms_of_y)));
  errors.w = bounded(Relative(w_, terms_of_w, Vector::Zero(w_.size())));
  return errors;
}

}  // namespace dlcs
