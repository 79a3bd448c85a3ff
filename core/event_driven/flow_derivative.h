// SPDX-License-Identifier: Apache-2.0
// The derivative of the state by the initial state, along an event-driven solve.

#ifndef DLCS_CORE_EVENT_DRIVEN_FLOW_DERIVATIVE_H_
#define DLCS_CORE_EVENT_DRIVEN_FLOW_DERIVATIVE_H_

#include <optional>

#include "core/discretization/step_sources.h"
#include "core/event_driven/mode.h"
#include "core/event_driven/smooth_step.h"
#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// Φ(t) = dx(t)/dx(0). In a mode Φ obeys its linear equation, and is integrated by the steps of the solution. A guard h
// that ends the mode does so at a time that depends on x(0). Since x is continuous there,
//
//     Φ⁺ = Φ⁻ + (f⁺ - f⁻) (∇h Φ⁻) / h',      f⁻, f⁺ = x' before and after, h' the slope of h before,
//
// the saltation matrix. At a fixed time (0, a break point) x jumps to ρ(x), and Φ⁺ = Dρ Φ⁻: the time does not move.
// Cost: one product with m columns in every step.
class FlowDerivative {
 public:
  // `slope_jumps`: x' may jump at events. Where y is a Lipschitz function of x it does not.
  FlowDerivative(Index num_states, bool slope_jumps);

  // The state jumped at a fixed time, with this derivative of the state after it by that before.
  void AddJump(const Matrix& derivative) { Phi_ = derivative * Phi_; }
  // As ErrorGrowth::AddStep() and AddEvent().
  void AddStep(const SmoothStep& step, const StepSources& sources, double s_end);
  void AddEvent(const Mode& mode, const SmoothStep& step, const StepSources& sources, double s_end, Index guard);
  // A coupled step was taken, whose derivative is not computed: there will be none.
  void GiveUp() { is_known_ = false; }

  // What is known after the last step.
  FlowRecord Record() const;

 private:
  // An event after which x' is not known yet.
  struct Event {
    Vector slope_before;
    Eigen::RowVectorXd delay;  // of the event by the initial state
  };

  const bool slope_jumps_;
  bool is_known_ = true;
  bool grazes_ = false;
  Matrix Phi_;
  Matrix slopes_;  // their derivatives at the end of the last step, if its mode is not explicit
  Vector begin_slope_, end_slope_;
  std::optional<Event> event_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_FLOW_DERIVATIVE_H_
