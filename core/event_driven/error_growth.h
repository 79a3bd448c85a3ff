// SPDX-License-Identifier: Apache-2.0
// Estimates the error of the solution, including how the system amplifies the errors of earlier steps and events.

#ifndef DLCS_CORE_EVENT_DRIVEN_ERROR_GROWTH_H_
#define DLCS_CORE_EVENT_DRIVEN_ERROR_GROWTH_H_

#include <array>
#include <limits>
#include <vector>

#include "core/context/component_errors.h"
#include "core/discretization/step_sources.h"
#include "core/event_driven/mode.h"
#include "core/event_driven/smooth_step.h"
#include "core/problem/problem.h"

namespace dlcs {

// Estimates the error of x by integrating error equations beside the solution. In a mode an error e obeys e' = Â e + d,
// where d holds the interpolation error of the sources and the rounding errors of the terms of x', including an ulp in
// every entry of the data. At an event at which x' jumps, an error moves the time of the event, so e jumps too. Three
// such e are integrated by the same steps as the solution, with d of its estimated size and three choices of signs:
// those of e, so that all contributions add up; constant ones; and pseudo-random ones in each step. The estimate is the
// largest of the three plus the local errors of the steps. If y is a Lipschitz function of x, the errors of B y and w
// are those that e makes of the guards plus their own. Cost: three solves of a step without refinement, for each step.
class ErrorGrowth {
 public:
  // Keeps a reference. `y_counts`: y is a Lipschitz function of x.
  ErrorGrowth(const Problem& problem, bool y_counts);

  // Integrates over `step` up to the position `s_end`. `overlooked` is caused by guards that are below zero but not
  // below their levels: an error of x', one of x where the mode holds x back, and one of y.
  struct Overlooked {
    Vector slope;
    Vector x;
    Vector y;
  };
  void AddStep(const SmoothStep& step, const StepSources& sources, const Overlooked& overlooked, double s_end);
  // The part of a change of x that is more than the errors so far.
  Vector Unexplained(const Vector& change) const;
  // Adds what x may be off by at the time reached.
  void AddMissed(const Vector& amount);
  // What the errors so far are in the guards of `mode`.
  Vector InGuards(const Mode& mode) const;
  // The event at `s_end`, at which the guard with the given index ended the mode.
  void AddEvent(const Mode& mode, const SmoothStep& step, const StepSources& sources, double s_end, Index guard);
  // Adds the error of a step of first order, which was estimated elsewhere; the state was off by `inside` on it.
  void Add(const Vector& error, const Vector& inside);

  // The largest errors so far of each component relative to its size; those of B y and w are empty if y does not count.
  // A state that is no larger than the bound of its rounding has an error of 0, since it may be rounding alone. If its
  // estimated error is at most a few times as large it is not: such states are added to `small_but_known`, which is
  // increasing, and the errors of those that it holds count.
  ComponentErrors RelativeTo(const Magnitudes& sizes, std::vector<Index>& small_but_known) const;

 private:
  static constexpr Index kErrors = 3;

  // An event, at position `s` of the step that found it, after which x' is not known yet.
  struct Event {
    LegendreSeries x;
    double length;
    double s;
    Vector slope;
    std::array<double, kErrors> delay;
  };
  void Pass(const SmoothStep& step, const StepSources& sources);
  // The signs that the error with this index is given, where it has those of `values`.
  Vector Signs(Index error, const Eigen::Ref<const Vector>& values) const;
  // Adds `amount` to the error with this index, with the signs that it is given.
  void AddTo(Index error, const Vector& amount);
  void Raise(const Matrix& errors, const Vector& within);
  // The errors of B y and w for the errors of x at the end of the step. What fast states make of them at its begin
  // decays at once. The guards move by step.guard * shift while time does by its rounding.
  void RaiseOutputs(const SmoothStep& step, const LegendreVector& shift, const Vector& overlooked_y);

  const Problem& problem_;
  Matrix errors_;  // one a column
  Matrix slopes_;  // their derivatives at the end of the last step, if its mode is not explicit
  bool has_event_ = false;
  Event event_;
  double last_event_ = -std::numeric_limits<double>::infinity();
  unsigned steps_ = 0;
  Vector x_, noise_, By_, w_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_ERROR_GROWTH_H_
