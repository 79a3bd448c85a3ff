// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode_end.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/event_driven/first_crossing.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/norms.h"
#include "core/linalg/schur_form.h"

namespace dlcs {
namespace {

// The zero of the series a little before `s`, where it is -level and falling; `s` itself where it only grazes
// zero.
double ZeroBefore(const LegendreVector& series, double s, double level) {
  const LegendreVector slope = DerivativeOf(series);
  double zero = s;
  for (int iteration = 0; iteration < 3; ++iteration) {
    const LegendreVector at = LegendreValues(zero);
    const double next = zero - series.dot(at) / slope.dot(at);
    if (!(next >= -1 && next <= s)) return s;
    zero = next;
  }
  return std::abs(series.dot(LegendreValues(zero))) < level / 16 ? zero : s;
}

double ValueAtBegin(const SmoothStep& step, Index guard) {
  return step.guard.values.row(guard).dot(LegendreValues(-1));
}

// The largest value of the guard before the step.
double SizeOfGuard(const Magnitudes& magnitudes, Index guard, bool is_active) {
  return is_active ? magnitudes.y[guard] : magnitudes.w[guard];
}

struct DipsByCause {
  Dip truncation, rounding;
  double ulp = 0;  // of the largest value of the guard so far
};

// The part of a guard that is below zero but above its level, or that may be: where the guard comes nearer to zero than
// its error, an event may have been missed. What is no deeper than rounding is rounding, the rest truncation. y and w
// of a pair are the two sides of one number, so that an ulp of its size is rounding too; `so_far`: that before the
// step.
DipsByCause MissedDip(const SmoothStep& step, Index guard, const ErrorBounds& of_state, double so_far, double s_end) {
  const LegendreVector series = step.guard.values.row(guard).transpose();
  const double noise = step.guard.error.rounding[guard];
  const double error = step.guard.error.truncation[guard] + of_state.truncation[guard] + of_state.rounding[guard];
  if (series[0] - series.tail<kLegendreDegree>().cwiseAbs().sum() > error) return {};
  const Dip dip = DipBelowZero(series, kOfNoise * noise, s_end);
  const auto near_zero = [&](double distance) {
    Dip may_be = dip;
    if (!(distance > noise)) return may_be;
    const auto minimum = LowestMinimum(series, s_end);
    if (!minimum || minimum->value >= distance) return may_be;
    const double depth = distance - std::max(minimum->value, 0.0);
    const double half_width = std::min(1.0, std::sqrt(2 * depth / minimum->curvature));
    may_be.depth = NanMax(may_be.depth, depth);
    may_be.mean = NanMax(may_be.mean, 4.0 / 3 * depth * half_width / (1 + s_end));  // of a parabola
    return may_be;
  };
  const double rounding = of_state.rounding[guard];
  const Dip both = near_zero(error);
  if (both.depth == 0) return {};
  Dip of_rounding = near_zero(rounding);
  constexpr double kMostNoise = 4;  // of which a guard has at most so many times as much; HostileSeeds feels it
  const double most = std::max(rounding, kMostNoise * noise);
  if (of_rounding.depth > most) of_rounding = {most, of_rounding.mean * most / of_rounding.depth};
  const double ulp = kUlp * std::max(so_far, MaxAbs(LooksBefore(s_end).transpose() * series));
  if (both.depth <= ulp) of_rounding = both;
  return {{both.depth - of_rounding.depth, both.mean - of_rounding.mean}, of_rounding, ulp};
}

// The fastest growth of y_T > 0 with w_T = 0 through x: y_T' = -(M_TT)⁻¹ N_T B_T y_T. Zero where y_T only decays, or is
// no function of x.
double FastestGrowth(const Problem& problem, const std::vector<Index>& pairs) {
  if (pairs.empty()) return 0;
  const Matrix inverse = Matrix(problem.M.Dense()(pairs, pairs)).inverse();
  if (!inverse.allFinite()) return 0;
  const Matrix moves = problem.N.Dense()(pairs, Eigen::all) * problem.B.Dense()(Eigen::all, pairs);
  const Matrix growth = -inverse * moves;
  const std::optional<SchurForm> schur = ComputeSchurForm(growth);
  return schur ? std::max(0.0, schur->triangle.diagonal().real().maxCoeff()) : 0;
}

// A pair that is not active, in the mode of `active`.
struct PairInMode {
  double M;         // of w_i by y_i, where the active y follow so that their w stay zero
  Vector of_y;      // x' by y_i, likewise
  double rate = 0;  // at which y_i would grow if the pair were active, too; zero if that is nothing new
};

PairInMode InMode(const Problem& problem, const std::vector<Index>& active, Index i) {
  const Matrix &B = problem.B.Dense(), &M = problem.M.Dense();
  PairInMode pair{M(i, i), B.col(i)};
  std::vector<Index> both = active;
  both.insert(std::lower_bound(both.begin(), both.end(), i), i);
  const double rate = std::max(FastestGrowth(problem, {i}), FastestGrowth(problem, both));
  if (rate == 0 || rate <= FastestGrowth(problem, active)) return pair;
  pair.rate = rate;
  const Matrix inverse = Matrix(M(active, active)).inverse();
  if (active.empty() || !inverse.allFinite()) return pair;
  const Vector follow = -(inverse * Vector(M(active, i)));
  const Vector of_w = Vector(M(i, active).transpose()).cwiseProduct(follow);
  pair.M += of_w.sum();
  // As small as rounding where the pairs together do not determine y.
  if (!(pair.M > kSingularY * (std::abs(M(i, i)) + of_w.cwiseAbs().sum()))) pair.rate = 0;
  pair.of_y += B(Eigen::all, active) * follow;
  return pair;
}

// The error of x where what is unknown of w_i may have decided that the pair stays inactive.
Vector OfRepelled(const Problem& problem, const SmoothStep& step, Index i, double unknown, double s_end,
                  double duration, RepelledStarts& repelled) {
  const PairInMode pair = InMode(problem, step.stepper->mode().active, i);
  if (!(pair.M > 0 && pair.rate > 0)) {
    repelled.End(i);
    return Vector::Zero(problem.num_states());
  }
  const double rate_in_s = pair.rate * duration / (1 + s_end);
  const double p = repelled.Follow(i, step.guard.values.row(i).transpose(), rate_in_s, unknown, s_end);
  return p / (pair.M * pair.rate) * pair.of_y.cwiseAbs();
}

// Where a guard has a dip.
struct DipPlace {
  Index guard;
  bool is_active;
  double duration, shortest;  // as in OverlookedEvents()
};

// Adds the effects of y_i > 0 that is missing, or of y_i < 0 that should be zero: w_i > 0 is missing then. `of_y`: what
// y_i is in x'.
void AddDip(const Problem& problem, const DipPlace& at, const Dip& dip, const Vector& of_y, Overlooked& to) {
  if (dip.depth == 0) return;
  const Index i = at.guard;
  const double M = problem.M.Dense()(i, i);
  const double moves = std::abs(problem.N.Dense().row(i).dot(problem.B.Dense().col(i)));  // w_i by y_i, a unit of time
  if (at.is_active) {
    to.slope += dip.mean * of_y;
    to.w[i] = M > 0 ? M * dip.depth : moves * at.duration * dip.mean;
  } else if (M > 0) {
    to.slope += dip.mean / M * of_y;
    // A triangle that is shorter than the error of the times of events is that error, of the event before.
    if (2 * dip.mean * at.duration > dip.depth * at.shortest) to.y[i] = dip.depth / M;
  } else if (moves > 0) {
    to.x += dip.depth / moves * of_y;
  }
}

}  // namespace

std::optional<ModeEnd> FindModeEnd(const SmoothStep& step) {
  std::optional<ModeEnd> end;
  for (Index i = 0; i < step.guard.values.rows(); ++i) {
    const auto s = FirstCrossing(step.guard.values.row(i).transpose(), step.guard_level[i], end ? end->s : 1);
    if (s && (!end || *s < end->s)) end = {*s, i};
  }
  if (end) end->s = ZeroBefore(step.guard.values.row(end->guard).transpose(), end->s, step.guard_level[end->guard]);
  return end;
}

bool FallsFromZero(const SmoothStep& step, const ModeEnd& end) {
  const double level = step.guard_level[end.guard], begin = ValueAtBegin(step, end.guard);
  const double between = step.guard.values.row(end.guard).dot(LegendreValues((end.s - 1) / 2));
  return begin < level / 16 && between < begin - level / 4;
}

bool StartsBelowByTruncation(const SmoothStep& step, Index guard) {
  const double tail = step.guard.tail[guard], begin = ValueAtBegin(step, guard);
  return tail > 4 * step.guard.error.rounding[guard] && begin < 0 && begin > -8 * tail;
}

void LetRisingGuardsStartBelow(SmoothStep& step) {
  constexpr double kLevels = 64;  // NetlistTest.PassesHysteresisWhereLargeTermsCancel fails without them
  const Vector begin = ValueOf(step.guard.values, LegendreValues(-1));
  const Vector slope = ValueOf(step.guard.values, LegendreSlopes(LegendreValues(-1)));
  for (Index i = 0; i < begin.size(); ++i) {
    const double allowed = std::max(step.guard_allowed[i], kLevels * step.guard_level[i]);
    if (begin[i] < 0 && begin[i] >= -allowed && slope[i] > 0)
      step.guard_level[i] = std::max(step.guard_level[i], -2 * begin[i]);
  }
}

bool RepelledStarts::MayBe(Index pair, const LegendreVector& w, double noise) const {
  return starts_[static_cast<std::size_t>(pair)].age > 0 || w.dot(LegendreValues(-1)) < noise;
}

double RepelledStarts::Follow(Index pair, const LegendreVector& w, double rate, double noise, double s_end) {
  constexpr double kStep = 0.1;                 // of the time 1/rate; RepelledStartsTest feels it
  static const double grown = -std::log(kUlp);  // such times: rounding has grown to the size of numbers
  Start& start = starts_[static_cast<std::size_t>(pair)];
  double s = -1, before = w.dot(LegendreValues(s));
  if (start.age == 0) start.p = before - noise;
  while (start.p < 0 && start.age < grown && s < s_end) {
    const double length = std::min(kStep / rate, s_end - s), aged = rate * length;
    s += length;
    const double value = w.dot(LegendreValues(s));
    start.p = std::exp(aged) * start.p + std::expm1(aged) / aged * (value - before);
    start.age += aged;
    before = value;
  }
  if (start.p < 0 && start.age < grown) return 0;
  return std::max(0.0, -std::exchange(start, {}).p);
}

OverlookedByCause OverlookedEvents(const Problem& problem, const SmoothStep& step, const ErrorBounds& of_state,
                                   const Magnitudes& magnitudes, double s_end, double duration, double shortest,
                                   RepelledStarts& repelled) {
  const Mode& mode = step.stepper->mode();
  const Vector no_state = Vector::Zero(problem.num_states());
  const Vector no_pair = Vector::Zero(problem.num_constraints());
  const Overlooked nothing{no_state, no_state, no_pair, no_pair};
  OverlookedByCause overlooked{nothing, nothing, nothing, no_pair, no_pair};
  for (Index i = 0; i < step.guard.values.rows(); ++i) {
    const bool is_active = std::binary_search(mode.active.begin(), mode.active.end(), i);
    const LegendreVector guard = step.guard.values.row(i).transpose();
    // More than is allowed counts as an error elsewhere.
    const double error_of_state = std::max(of_state.truncation[i], of_state.rounding[i]);
    const double unknown = step.guard.error.rounding[i] + std::min(error_of_state, step.guard_allowed[i]);
    if (is_active || !repelled.MayBe(i, guard, unknown)) {
      repelled.End(i);
    } else {
      const Vector repelled_by = OfRepelled(problem, step, i, unknown, s_end, duration, repelled);
      overlooked.truncation.x += repelled_by;
      overlooked.with_signs.x += repelled_by;
    }
    const DipsByCause dips = MissedDip(step, i, of_state, SizeOfGuard(magnitudes, i, is_active), s_end);
    if (dips.rounding.depth == 0 && dips.truncation.depth == 0) continue;
    const Vector of_y = problem.B.Dense().col(i);
    const auto add = [&](const Dip& dip, const Vector& signs, Overlooked& to) {
      AddDip(problem, {i, is_active, duration, shortest}, dip, signs, to);
    };
    add(dips.rounding, of_y.cwiseAbs(), overlooked.rounding);
    add(dips.truncation, of_y.cwiseAbs(), overlooked.truncation);
    add(dips.truncation, of_y, overlooked.with_signs);
  }
  if (!mode.is_explicit()) {
    const Vector settles = problem.A.Dense().diagonal().cwiseAbs().cwiseInverse();
    for (Overlooked* of : {&overlooked.truncation, &overlooked.rounding, &overlooked.with_signs}) {
      of->x += of->slope.cwiseProduct(settles.cwiseMin(duration));
    }
  }
  return overlooked;
}

double RatioOfDips(const Problem& problem, const SmoothStep& step, const Magnitudes& magnitudes, double tolerance,
                   double s_end, double duration, double shortest) {
  const std::vector<Index>& active = step.stepper->mode().active;
  const Vector no_error = Vector::Zero(problem.num_constraints()), no_state = Vector::Zero(problem.num_states());
  const ErrorBounds of_state{no_error, no_error};
  double ratio = 0;
  for (Index i = 0; i < no_error.size(); ++i) {
    const bool is_active = std::binary_search(active.begin(), active.end(), i);
    const DipsByCause dips = MissedDip(step, i, of_state, SizeOfGuard(magnitudes, i, is_active), s_end);
    const Dip& dip = dips.truncation;
    if (dip.depth == 0) continue;
    Overlooked of{no_state, no_state, no_error, no_error};
    AddDip(problem, {i, is_active, duration, shortest}, dip, problem.B.Dense().col(i).cwiseAbs(), of);
    const double of_errors =
        NanMax(LargestRatio(of.x + duration * of.slope, tolerance * magnitudes.x.cwiseMax(step.x_size)),
               NanMax(LargestRatio(of.y, tolerance * magnitudes.y), LargestRatio(of.w, tolerance * magnitudes.w)));
    const double of_rounding = dip.depth / std::max(dips.ulp, step.guard.error.rounding[i]);
    ratio = NanMax(ratio, std::min(of_errors, of_rounding));
  }
  return ratio;
}

}  // namespace dlcs
