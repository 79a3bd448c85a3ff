// SPDX-License-Identifier: Apache-2.0
#include "core/event_driven/flow_derivative.h"

#include <cmath>
#include <utility>

#include "core/discretization/legendre.h"

namespace dlcs {
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
  ModeStepper::Response response = step.stepper->RespondAt(s_end, Phi_, Matrix());
  Phi_ = std::move(response.values);
  slopes_ = std::move(response.slopes);
  end_slope_ = SlopeAt(step, sources, s_end);
}

void FlowDerivative::AddEvent(const Mode& mode, const SmoothStep& step, const StepSources& sources, double s_end,
                              Index guard) {
  // A guard that falls through its level by less than this part of its size in a whole step touches zero: the time of
  // the event is no smooth function of the state, and the derivative holds on one side at best.
  constexpr double kTouches = 1e-6;
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
