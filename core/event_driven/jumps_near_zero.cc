// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/jumps_near_zero.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/event_driven/magnitudes.h"
#include "core/lcp/lcp.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr Index kOperationsOfSlope = 16;  // of w_i' by the equations

// The parts of a step on which a guard is below `distance`. Of the last one, where the guard falls to its event, only
// what is below zero: the error of the time of the event counts the rest.
std::vector<PartOfStep> PartsNearZero(const LegendreVector& series, double distance, double s_end, bool ends_mode) {
  std::vector<PartOfStep> parts = PartsBelowZero(series, -distance, s_end);
  if (ends_mode && !parts.empty() && parts.back().end == s_end) {
    parts.pop_back();
    const std::vector<PartOfStep> below = PartsBelowZero(series, 0, s_end);
    if (!below.empty() && below.back().end == s_end) parts.push_back(below.back());
  }
  return parts;
}

// By how much y jumps where the guard falls through zero: the solution of the LCP for the y and w of the step where the
// guard is lowest, with the guard as far below zero as `error`. Zero if the LCP alone does not decide.
Vector JumpAcross(const Problem& problem, LcpSolver& lcp, const SmoothStep& step, Index guard, double error,
                  double s_end) {
  const std::vector<Index>& active = step.stepper->mode().active;
  LegendreRows at;
  LegendreValuesAt((s_end + 1) / 2 * (GetLegendreBasis().nodes.array() + 1) - 1, at);
  Index lowest = 0;
  (at * step.guard.values.row(guard).transpose()).minCoeff(&lowest);
  const Vector guards = step.guard.values * at.row(lowest).transpose();
  Vector y = Vector::Zero(guards.size()), w = guards;
  Basis basis(static_cast<std::size_t>(guards.size()), 0);
  for (const Index i : active) {
    y[i] = guards[i];
    w[i] = 0;
    basis[static_cast<std::size_t>(i)] = 1;
  }
  (basis[static_cast<std::size_t>(guard)] ? y : w)[guard] = -error;
  Vector after(y.size());
  const LcpStatus status = lcp.Solve(w - problem.M * y, Vector::Zero(y.size()), basis, after);
  return status == LcpStatus::kSolved ? Vector(after - y) : Vector::Zero(y.size());
}

// How fast the w_i of a pair falls. It is from the equations: the polynomial of w_i has the rounding of w_i over the
// length. Where y depends on x', that of M y is left.
class SpeedOfFall {
 public:
  // Keeps references, and samples the slope of g. `x_error` and `guard_error`: what x and the guards are off by, beside
  // the rounding of the step.
  SpeedOfFall(const Problem& problem, const SmoothStep& step, Index pair, const Vector& x_error,
              const Vector& guard_error, SourceSampler& sampler, StepSources& sources)
      : step_(step), sources_(sources) {
    if (!sources.g.is_steady && sources.g.slope.rows() == 0) sampler.SampleSlope(sources);
    const Mode& mode = step.stepper->mode();
    if (mode.is_explicit()) {
      row_ = mode.guard.state.row(pair);
      row_g_ = mode.guard.g.size() > 0 ? Row(mode.guard.g.row(pair)) : Row(Row::Zero(problem.num_constraints()));
    } else {
      row_ = problem.N.Dense().row(pair);
      row_g_ = Row::Unit(problem.num_constraints(), pair);
      of_slopes_ = problem.M.Dense().row(pair) * step.y;
    }
    of_x_ = row_ * problem.A.Dense();
    of_y_ = row_ * problem.B.Dense();
    x_terms_ = row_.cwiseAbs().lazyProduct(problem.A.Dense().cwiseAbs());
    y_terms_ = row_.cwiseAbs().lazyProduct(problem.B.Dense().cwiseAbs());
    Vector y_error = Vector::Zero(problem.num_constraints());
    for (const Index k : mode.active) y_error[k] = guard_error[k] + kOfNoise * step.guard.error.rounding[k];
    error_ = row_.cwiseAbs().dot(problem.A.AbsTimes(x_error + kOfNoise * step.x_error.rounding) +
                                 problem.B.AbsTimes(y_error));
    if (!sources.g.is_steady) error_ += row_g_.cwiseAbs().dot(sources.g.slope_rounding);
  }

  // The largest one on a part of the step, beyond what it is off by.
  double Known(PartOfStep part) const { return On(part, -1); }
  // The largest one that it may be, for what it is off by.
  double Possible(PartOfStep part) const { return On(part, 1); }

 private:
  using Row = Eigen::RowVectorXd;

  // With so many times what it is off by.
  double On(PartOfStep part, double errors) const {
    const Vector s = part.begin + (part.end - part.begin) * (1 + GetLegendreBasis().nodes.array()) / 2;
    LegendreRows at;
    LegendreValuesAt(s, at);
    const Matrix x = step_.x.lazyProduct(at.transpose());
    const Matrix y = step_.y.lazyProduct(at.transpose()).cwiseMax(0);
    const Matrix f = sources_.f.values.lazyProduct(at.transpose());
    Row slope = of_x_ * x + of_y_ * y + row_ * f;
    const Row terms = x_terms_ * x.cwiseAbs() + y_terms_ * y + row_.cwiseAbs() * f.cwiseAbs();
    if (!sources_.g.is_steady) slope += (row_g_ * sources_.g.slope).lazyProduct(at.transpose());
    if (of_slopes_.size() > 0) {
      for (Index k = 0; k < s.size(); ++k)
        slope[k] += 2 / sources_.length * of_slopes_.dot(LegendreSlopes(at.row(k).transpose()));
    }
    double speed = 0;
    for (Index k = 0; k < s.size(); ++k)
      speed = NanMax(speed, errors * (RoundingOf(kOperationsOfSlope) * terms[k] + error_) - slope[k]);
    return speed;
  }

  const SmoothStep& step_;
  const StepSources& sources_;
  Row row_, row_g_, of_x_, of_y_, x_terms_, y_terms_;
  Row of_slopes_;  // M y of the pair, as a polynomial, where y depends on x'
  double error_;
};

// Whether the w_i of a pair that is not active is above zero by its rounding at times inside a part of a step, or zero
// without rounding. Its polynomial has the rounding of the largest value of the step everywhere, and N x + g at one
// time may have less. `of_state`: what the rounding of x at the start makes of w_i.
bool IsSurelyPositive(const Problem& problem, const SmoothStep& step, Index i, PartOfStep part, double of_state,
                      SourceSampler& sampler, const StepSources& sources) {
  const Mode& mode = step.stepper->mode();
  if (!mode.is_explicit()) return false;
  const Eigen::RowVectorXd of_x = mode.guard.state.row(i);
  const bool has_g = mode.guard.g.size() > 0;
  const double part_rounded = RoundingOfProduct(problem.num_states() + problem.num_constraints());
  const double of_start = of_x.cwiseAbs().dot(kOfNoise * step.x_error.rounding) + of_state;
  Vector g(problem.num_constraints()), g_terms(g.size());
  // A power of the time since its begin keeps its sign for octaves.
  for (double length = part.end - part.begin; part.begin + length > part.begin; length /= 2) {
    const double s = part.begin + length;
    const Vector x = ValueOf(step.x, LegendreValues(s));
    BoundedSum w{of_x.dot(x), of_x.cwiseAbs().dot(x.cwiseAbs())};
    if (has_g) {
      const double time = sources.begin + (1 + s) / 2 * sources.length;
      sampler.G(time, Side::kRight, g);
      sampler.TermsOfG(time, g_terms);
      w.value += mode.guard.g.row(i).dot(g);
      w.terms += mode.guard.g.row(i).cwiseAbs().dot(g_terms);
    }
    if (!(w.value >= part_rounded * w.terms + of_start)) return false;
  }
  return true;
}

}  // namespace

JumpsNearZero::JumpsNearZero(const Problem& problem, Selection selection, bool y_is_lipschitz)
    : problem_(problem), selection_(selection), y_is_lipschitz_(y_is_lipschitz) {
  const Matrix &B = problem.B.Dense(), &N = problem.N.Dense(), &M = problem.M.Dense();
  for (Index i = 0; i < problem.num_constraints(); ++i) {
    const double moves = N.row(i).dot(B.col(i));
    pairs_.push_back({i, M(i, i), std::abs(moves), moves > 0});
  }
}

void JumpsNearZero::AddTo(const SmoothStep& step, const ErrorBounds& of_state, const Vector& x_error, double s_end,
                          bool begins_mode, std::optional<Index> ends_mode, SourceSampler& sampler,
                          StepSources& sources, OverlookedByCause& overlooked) {
  const std::vector<Index>& active = step.stepper->mode().active;
  for (OfPair& of : pairs_) {
    const bool is_active = std::binary_search(active.begin(), active.end(), of.pair), ends = of.pair == ends_mode;
    if (!is_active) AddHidden(of, step, of_state, s_end, ends_mode, sampler, sources, overlooked);
    if (of.M == 0 && !y_is_lipschitz_)
      AddJump(of, step, of_state, x_error, s_end, begins_mode, ends, sampler, sources, overlooked);
  }
}

// Where w_i is as near to zero as its rounding, and does not surely rise as from an event, y_i may be what holds it up:
// by M_ii y_i, no more than that rounding; or through x, where it lifts w_i by no more than that rounding, nor than w_i
// may have fallen.
void JumpsNearZero::AddHidden(const OfPair& of, const SmoothStep& step, const ErrorBounds& of_state, double s_end,
                              std::optional<Index> ends_mode, SourceSampler& sampler, StepSources& sources,
                              OverlookedByCause& overlooked) const {
  const Index i = of.pair;
  if (!(of.M > 0) && of.moves == 0) return;
  const double rounding = kOfNoise * step.guard.error.rounding[i] + of_state.rounding[i];
  const LegendreVector guard = step.guard.values.row(i).transpose();
  const std::vector<PartOfStep> parts = PartsNearZero(guard, rounding, s_end, i == ends_mode);
  if (parts.empty()) return;
  // The slope of a polynomial of degree K that is no larger than `rounding` is at most K² times as large (Markov).
  constexpr double kOfSlope = kLegendreDegree * kLegendreDegree;
  const LegendreVector slope = DerivativeOf(guard);
  const auto may_hide = [&](const PartOfStep& part) {
    const bool surely_rises =
        std::min(slope.dot(LegendreValues(part.begin)), slope.dot(LegendreValues(part.end))) > kOfSlope * rounding;
    return !surely_rises && !IsSurelyPositive(problem_, step, i, part, of_state.rounding[i], sampler, sources);
  };
  if (std::none_of(parts.begin(), parts.end(), may_hide)) return;
  const Vector exact = Vector::Zero(problem_.num_states());
  const SpeedOfFall speed(problem_, step, i, exact, of_state.rounding, sampler, sources);
  // Between two of the parts it falls.
  const double falls = speed.Possible({parts.front().begin, parts.back().end});
  if (falls == 0) return;
  double length = 0;
  for (const PartOfStep& part : parts) length += part.end - part.begin;
  double largest = std::numeric_limits<double>::infinity(), integral = largest;  // of y_i, that over s
  if (of.M > 0) {
    largest = rounding / of.M;
    integral = length * largest;
  }
  if (!(of.M > 0) || of.lifts) {
    double in_parts = 0;
    for (const PartOfStep& part : parts) {
      // The next mode decides on what falls to zero at an event.
      if (!(ends_mode && part.end == s_end)) in_parts = NanMax(in_parts, speed.Possible(part));
    }
    largest = std::min(largest, in_parts / of.moves);
    integral = std::min(integral, std::min(length * falls, 2 * rounding / sources.length) / of.moves);
  }
  overlooked.rounding.slope += integral / (1 + s_end) * problem_.B.Dense().col(i).cwiseAbs();
  overlooked.y_hidden[i] = NanMax(overlooked.y_hidden[i], largest);
}

void JumpsNearZero::AddJump(OfPair& of, const SmoothStep& step, const ErrorBounds& of_state, const Vector& x_error,
                            double s_end, bool begins_mode, bool ends_mode, SourceSampler& sampler,
                            StepSources& sources, OverlookedByCause& overlooked) {
  const Mode& mode = step.stepper->mode();
  const Index i = of.pair;
  const double noise = step.guard.error.rounding[i], rounding = of_state.rounding[i];
  const double truncation = step.guard.error.truncation[i] + of_state.truncation[i];
  const double within_rounding = rounding + std::min(truncation, kOfNoise * noise), within_both = rounding + truncation;
  const LegendreVector guard = step.guard.values.row(i).transpose();
  const bool leaves_event = std::exchange(of.leaves_event, false) || begins_mode;
  std::vector<PartOfStep> near = PartsNearZero(guard, within_both, s_end, ends_mode);
  if (near.empty()) return of.EndRow();
  const SpeedOfFall speed(problem_, step, i, x_error + step.x_error.truncation, of_state.truncation + of_state.rounding,
                          sampler, sources);
  // Nothing is hidden where the guard rises from the event that its mode began with.
  const auto drop_rise = [&](std::vector<PartOfStep>& parts) {
    if (!leaves_event || parts.empty() || parts.front().begin != -1 || speed.Known(parts.front()) != 0) return;
    of.leaves_event = of.leaves_event || parts.front().end == s_end;
    parts.erase(parts.begin());
  };
  drop_rise(near);
  if (near.empty()) return of.EndRow();
  // The LCP alone decides for relays, in modes where y is determined without x'.
  Vector jump = Vector::Zero(problem_.num_constraints());
  if (mode.is_explicit()) {
    if (!lcp_) lcp_ = MakeLcpSolver(problem_.M, selection_);
    jump = JumpAcross(problem_, *lcp_, step, i, noise + within_both, s_end);
  }
  const bool y_jumps = !jump.isZero(0);
  const bool may_touch = of.moves > 0 && !std::binary_search(mode.active.begin(), mode.active.end(), i);
  if (!y_jumps && !may_touch) return of.EndRow();
  // What y may be off by, as a multiple of y_by: the largest value, and the integral over s on such parts.
  const Vector y_by = y_jumps ? Vector(jump.cwiseAbs()) : Vector(Vector::Unit(jump.size(), i));
  double largest = 0;
  const auto integral_on = [&](const std::vector<PartOfStep>& parts) {
    double integral = 0;
    for (const PartOfStep& part : parts) {
      const double y = y_jumps ? 1 : speed.Known(part) / of.moves;
      largest = NanMax(largest, y);
      integral += (part.end - part.begin) * y;
    }
    return integral;
  };
  const double both = integral_on(near);
  double of_rounding = both;
  if (within_rounding < within_both) {
    std::vector<PartOfStep> nearer = PartsNearZero(guard, within_rounding, s_end, ends_mode);
    drop_rise(nearer);
    of_rounding = std::min(both, integral_on(nearer));
  }
  const double of_truncation = both - of_rounding;
  // A y_i that pushes w_i away from zero makes up for what x is off by.
  if (y_jumps && of.moves == 0) {
    const Vector x_slope = problem_.B * jump / (1 + s_end);
    overlooked.rounding.slope += of_rounding * x_slope.cwiseAbs();
    overlooked.truncation.slope += of_truncation * x_slope.cwiseAbs();
    overlooked.with_signs.slope += of_truncation * x_slope;
  }
  if (of.truncation.size() == 0) of.truncation = of.rounding = Vector::Zero(jump.size());
  const double part_of_time = sources.length / 2 / problem_.horizon;
  of.rounding += part_of_time * of_rounding * y_by;
  of.truncation += part_of_time * of_truncation * y_by;
  overlooked.rounding.y = overlooked.rounding.y.cwiseMax(of.rounding);
  overlooked.truncation.y = overlooked.truncation.y.cwiseMax(of.truncation);
  // AddHidden() has the force that rounding hides.
  if (y_jumps || of_truncation > 0) overlooked.y_size = overlooked.y_size.cwiseMax(largest * y_by);
}

}  // namespace dlcs
