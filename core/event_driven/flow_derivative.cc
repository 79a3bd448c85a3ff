// SPDX-License-Identifier: Apache-2.0
#include "core/event_driven/flow_derivative.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <utility>

#include "core/discretization/legendre.h"

namespace dlcs {
namespace {

// The |z| up to which the Padé approximation (K-1, K) is e^z to rounding: it differs by c z^{2K} (1 + O(z)) with
// c = (K-1)! K! / ((2K-1)! (2K)!).
double LargestResolved() {
  constexpr int K = static_cast<int>(kLegendreDegree);
  double log = std::log(std::numeric_limits<double>::epsilon());
  for (int k = K; k < 2 * K; ++k) log += std::log(k) + std::log(k + 1);
  return std::exp(log / (2 * K));
}

// How often a length must be halved before a step of it is the exponential to rounding, for every part of a state that
// the exponential does not make less than that.
int HalvingsFor(const Mode& mode, double length) {
  static const double resolved = LargestResolved();
  static const double lost = std::log(std::numeric_limits<double>::epsilon());
  double largest = 0;
  for (const std::complex<double>& eigenvalue : mode.eigenvalues) {
    if (eigenvalue.real() * length > lost) largest = std::max(largest, std::abs(eigenvalue) * length);
  }
  if (!(largest > resolved) || !std::isfinite(largest)) return 0;
  return static_cast<int>(std::ceil(std::log2(largest / resolved)));
}

// What the mode of `step` makes of `starts` up to `s_end`. A step is as long as the solution allows, which may be at
// rest while disturbances of it oscillate.
ModeStepper::Response Propagate(const SmoothStep& step, double s_end, const Matrix& starts) {
  const Mode& mode = step.stepper->mode();
  const double length = step.stepper->length() * (1 + s_end) / 2;
  const int halvings = HalvingsFor(mode, length);
  if (halvings == 0) return step.stepper->RespondAt(s_end, starts, Matrix());
  const ModeStepper part(mode, std::ldexp(length, -halvings));
  Matrix parts = part.RespondAt(1, Matrix::Identity(starts.rows(), starts.rows()), Matrix()).values;
  // All parts but the last one: 1 + 2 + 4 + ... of them.
  Matrix values = starts;
  for (int k = 0; k < halvings; ++k) {
    values = parts * values;
    parts = parts * parts;
  }
  return part.RespondAt(1, values, Matrix());
}

}  // namespace

FlowDerivative::FlowDerivative(Index num_states, bool slope_jumps)
    : slope_jumps_(slope_jumps), Phi_(Matrix::Identity(num_states, num_states)) {}

void FlowDerivative::AddStep(const SmoothStep& step, const StepSources& sources, double s_end) {
  if (begin_slope_.size() == 0) begin_slope_ = SlopeAt(step, sources, -1);
  if (event_) {
    Phi_ += (event_->slope_before - SlopeAt(step, sources, -1)) * event_->delay;
    event_.reset();
  }
  const Mode& mode = step.stepper->mode();
  // A state off the constraints of the mode would be moved onto them.
  if (mode.num_algebraic > 0) Phi_ -= mode.correction * Matrix(mode.algebraic_rows() * Phi_);
  ModeStepper::Response response = Propagate(step, s_end, Phi_);
  Phi_ = std::move(response.values);
  slopes_ = std::move(response.slopes);
  end_slope_ = SlopeAt(step, sources, s_end);
}

void FlowDerivative::AddEvent(const Mode& mode, const SmoothStep& step, const StepSources& sources, double s_end,
                              Index guard) {
  // A guard that falls through its level by less than this part of its size in a whole step touches zero: the time of
  // the event is no smooth function of the state, and the derivative holds on one side at best.
  constexpr double kTouches = 1e-6;  // FlowDerivativeTest feels it
  const LegendreVector slope_at = LegendreSlopes(LegendreValues(s_end));
  const double fall = step.guard.values.row(guard).dot(slope_at);
  if (!(std::abs(fall) > kTouches * step.guard.values.row(guard).cwiseAbs().sum())) grazes_ = true;
  if (!slope_jumps_ || fall == 0) return;
  Eigen::RowVectorXd moved = mode.guard.state.row(guard) * Phi_;
  if (mode.guard.slope.size() > 0) moved += mode.guard.slope.row(guard) * slopes_;
  event_ = Event{.slope_before = SlopeAt(step, sources, s_end), .delay = -sources.length / 2 / fall * moved};
}

FlowRecord FlowDerivative::Record() const {
  FlowRecord record;
  if (is_known_) record.derivative = Phi_;
  record.begin_slope = begin_slope_;
  record.end_slope = end_slope_;
  record.grazes = grazes_;
  return record;
}

}  // namespace dlcs
