// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/jumps_near_zero.h"

#include <algorithm>
#include <cmath>
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

// How fast the w_i of a pair falls, beyond what that is off by. It is from the equations: the polynomial of w_i has the
// rounding of w_i over the length. Where y depends on x', that of M y is left.
class SpeedOfFall {
 public:
  // Keeps references. `sources` has the slope of g. `slope_error`: what x' is off by.
  SpeedOfFall(const Problem& problem, const SmoothStep& step, const StepSources& sources, Index pair,
              const Vector& slope_error)
      : step_(step), sources_(sources) {
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
    error_ = row_.cwiseAbs().dot(slope_error);
    if (!sources.g.is_steady) error_ += row_g_.cwiseAbs().dot(sources.g.slope_rounding);
  }

  // The largest one on a part of the step.
  double On(PartOfStep part) const {
    Vector s(kLegendreSize + 1);
    s << part.begin, part.begin + (part.end - part.begin) * (1 + GetLegendreBasis().nodes.array()) / 2;
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
      speed = NanMax(speed, -slope[k] - RoundingOf(kOperationsOfSlope) * terms[k] - error_);
    return speed;
  }

 private:
  using Row = Eigen::RowVectorXd;
  const SmoothStep& step_;
  const StepSources& sources_;
  Row row_, row_g_, of_x_, of_y_, x_terms_, y_terms_;
  Row of_slopes_;  // M y of the pair, as a polynomial, where y depends on x'
  double error_;
};

}  // namespace

JumpsNearZero::JumpsNearZero(const Problem& problem, Selection selection, bool y_is_lipschitz)
    : problem_(problem), selection_(selection) {
  if (y_is_lipschitz) return;
  const Matrix &B = problem.B.Dense(), &N = problem.N.Dense(), &M = problem.M.Dense();
  for (Index i = 0; i < problem.num_constraints(); ++i) {
    if (M(i, i) == 0) pairs_.push_back({i, std::abs(N.row(i).dot(B.col(i)))});
  }
}

void JumpsNearZero::AddTo(const SmoothStep& step, const ErrorBounds& of_state, const Vector& x_error, double s_end,
                          bool begins_mode, std::optional<Index> ends_mode, SourceSampler& sampler,
                          StepSources& sources, OverlookedByCause& overlooked) {
  for (OfPair& of : pairs_) {
    AddOf(of, step, of_state, x_error, s_end, begins_mode, of.pair == ends_mode, sampler, sources, overlooked);
  }
}

void JumpsNearZero::AddOf(OfPair& of, const SmoothStep& step, const ErrorBounds& of_state, const Vector& x_error,
                          double s_end, bool begins_mode, bool ends_mode, SourceSampler& sampler, StepSources& sources,
                          OverlookedByCause& overlooked) {
  const Mode& mode = step.stepper->mode();
  const Index i = of.pair;
  const double noise = step.guard.error.rounding[i], rounding = of_state.rounding[i];
  const double truncation = step.guard.error.truncation[i] + of_state.truncation[i];
  const double within_rounding = rounding + std::min(truncation, kOfNoise * noise), within_both = rounding + truncation;
  const LegendreVector guard = step.guard.values.row(i).transpose();
  const bool leaves_event = std::exchange(of.leaves_event, false) || begins_mode;
  std::vector<PartOfStep> near = PartsNearZero(guard, within_both, s_end, ends_mode);
  if (near.empty()) return of.EndRow();
  if (!sources.g.is_steady && sources.g.slope.rows() == 0) sampler.SampleSlope(sources);
  Vector y_error = Vector::Zero(problem_.num_constraints());
  for (const Index k : mode.active)
    y_error[k] = of_state.truncation[k] + of_state.rounding[k] + kOfNoise * step.guard.error.rounding[k];
  const Vector slope_error = problem_.A.AbsTimes(x_error + step.x_error.truncation + kOfNoise * step.x_error.rounding) +
                             problem_.B.AbsTimes(y_error);
  const SpeedOfFall speed(problem_, step, sources, i, slope_error);
  // Nothing is hidden where the guard rises from the event that its mode began with.
  const auto drop_rise = [&](std::vector<PartOfStep>& parts) {
    if (!leaves_event || parts.empty() || parts.front().begin != -1 || speed.On(parts.front()) != 0) return;
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
      const double y = y_jumps ? 1 : speed.On(part) / of.moves;
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
  overlooked.y_size = overlooked.y_size.cwiseMax(largest * y_by);
}

}  // namespace dlcs
