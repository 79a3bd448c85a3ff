// SPDX-License-Identifier: Apache-2.0
// What becomes of the errors of steps and events.

#ifndef DLCS_CORE_EVENT_DRIVEN_ERROR_GROWTH_H_
#define DLCS_CORE_EVENT_DRIVEN_ERROR_GROWTH_H_

#include <array>

#include "core/discretization/step_sources.h"
#include "core/event_driven/mode.h"
#include "core/event_driven/smooth_step.h"

namespace dlcs {

// Signs for the rounding of `size` numbers, without a pattern that a system could share; others for each `seed`.
Vector SignsOfRounding(Index size, unsigned seed = 0);

// Estimates the error of x by what the system makes of errors. In a mode an error obeys e' = Â e + d, where d is what
// the sources miss and the rounding of the terms of x': that of an ulp in every entry of the data, too. At an event at
// which x' jumps it moves the time of the event, and jumps itself. A few such e are carried along with the solution,
// solved exactly like it, with d of its estimated size and of different signs: those of e, so that what is missed adds
// up; always the same; and others at each step. The estimate is the largest of them, and what is left of the steps in
// between. Cost: three solves of a step without refinement, for each step.
class ErrorGrowth {
 public:
  explicit ErrorGrowth(const Vector& x0);

  // The part of `step` up to the position `s_end`; `overlooked` is what x' is off by where guards were below zero, but
  // not below their levels.
  void AddStep(const SmoothStep& step, const StepSources& sources, const Vector& overlooked, double s_end);
  // The guard that ended it there.
  void AddEvent(const Mode& mode, const SmoothStep& step, const StepSources& sources, double s_end, Index guard);
  // Something else that was estimated: a step of first order.
  void Add(const Vector& error);

  const Vector& x() const { return x_; }  // of each component, the largest so far

  // The errors of x relative to the `size` of each component; none where a component is zero to rounding.
  Vector RelativeTo(const Vector& size) const;

 private:
  static constexpr Index kErrors = 3;

  // An event at which x' is not known yet on the other side.
  struct Event {
    Vector slope_before;
    std::array<double, kErrors> delay;
  };
  void Pass(const SmoothStep& step, const StepSources& sources);
  Vector Signs(Index error) const;
  void Raise(const Vector& within);

  Matrix errors_;  // one a column
  bool has_event_ = false;
  Event event_;
  unsigned steps_ = 0;
  Vector x_, noise_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_ERROR_GROWTH_H_
