// SPDX-License-Identifier: Apache-2.0
// Estimates the error of the solution, including how the system amplifies the errors of earlier steps and events.

#ifndef DLCS_CORE_EVENT_DRIVEN_ERROR_GROWTH_H_
#define DLCS_CORE_EVENT_DRIVEN_ERROR_GROWTH_H_

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "core/discretization/error_bounds.h"
#include "core/discretization/step_sources.h"
#include "core/event_driven/mode.h"
#include "core/event_driven/sampled_errors.h"
#include "core/event_driven/smooth_step.h"
#include "core/problem/accuracy.h"
#include "core/problem/problem.h"

namespace dlcs {

// Estimates the errors of the solution by integrating error equations beside it (SampledErrors). At an event at which
// x' jumps, an error moves the time of the event, so e jumps too. Near an event the solution is compared up to that
// shift in time: where a fast state settles, or y falls to zero within picoseconds, the difference at one time shows
// nothing but the shift. Where the truncation with its signs is no more than rounding, as in a state that is zero by
// symmetry, there is none.
class ErrorGrowth {
 public:
  // Keeps a reference. The sizes at x0 are the first ones.
  explicit ErrorGrowth(const Problem& problem);

  // Integrates over `step` up to the position `s_end`.
  // `guard`: the one that ends the mode at `s_end`, if one does. Returns how far the time of that event may be off.
  double AddStep(const SmoothStep& step, const StepSources& sources, const OverlookedByCause& overlooked, double s_end,
                 std::optional<Index> guard);
  // A break point of the sources at the end of `step`, whose time may be off by `rounding`.
  void AddBreak(const SmoothStep& step, const StepSources& sources, double rounding);
  // What the time of the last event, break point or end of a delay is off by in each sample of the errors; 0 at 0.
  const TimeErrors& ErrorsOfTime() const { return event_.delay; }
  // At the end of `step` a delay ends that began at a time with these errors.
  void AddEndOfDelay(const SmoothStep& step, const StepSources& sources, const TimeErrors& errors_of_time);
  // The size of such errors, both causes together.
  static double SizeOf(const TimeErrors& errors_of_time);
  // Adds what x may be off by at the time reached, by rounding.
  void AddRounding(const Vector& amount) { errors_.AddRounding(amount); }
  // The state becomes J x + j at the time reached; `amount` is the rounding of that. What the error of the time makes
  // of it passes the reset, too: x' before the event is J x' then.
  void Reset(const Matrix& J, const Vector& amount);
  // The errors so far in the guards of `mode`.
  ErrorBounds InGuards(const Mode& mode) const;
  // Samples of those of x, one a column.
  const Matrix& Samples() const { return errors_.values(); }
  // Those of each state, both causes together.
  Vector InState() const;
  // Adds the error of a step of first order, which was estimated elsewhere; the state was off by `inside` on it.
  void Add(const Vector& error, const Vector& inside);
  // Of that step, how far w is off inside of it.
  void AddInside(const Vector& of_w);

  // The largest errors so far of each component, and the sizes in `sizes`.
  TrajectoryErrors Errors(const Magnitudes& sizes) const;

 private:
  // An event or a break point, at position `s` of the step that led to it, after which x' is not known yet.
  struct Event {
    LegendreSeries x;
    double length;
    double s;
    bool is_break = false;
    Vector slope;
    Vector y, w, outputs;
    TimeErrors delay = {};
  };
  void Pass(const SmoothStep& step, const StepSources& sources);
  void BeginJump(const SmoothStep& step, const StepSources& sources, double s);
  // What the errors are early in `step`, before fast states have settled.
  void RaiseSoonAfter(const SmoothStep& step);
  // What jumps of y, w and outputs come to by the error of the time of the event.
  void RaiseJumps(const SmoothStep& step);
  // How far the time of the event may be off.
  SignedErrorBounds Delays() const { return BoundsOf(event_.delay); }
  static SignedErrorBounds BoundsOf(const TimeErrors& errors_of_time);
  double BeginEvent(const SmoothStep& step, const StepSources& sources, double s_end, Index guard);
  // The errors of y and w for those of x at the end of the step. What fast states make of them at its begin decays at
  // once. `slope_at` makes slopes of polynomials; `shifts` are the times that excuse the errors; `left_inside` is what
  // the refinement left of x at some times of the step, or empty where an event cuts it.
  void RaiseOutputs(const SmoothStep& step, const LegendreVector& slope_at, const Eigen::RowVectorXd& shifts,
                    const OverlookedByCause& overlooked, const Matrix& left_inside);

  SignedErrorBounds InRows(const LinearOutput& output, const StepRows& rows, const LegendreVector& slope_at,
                           const Eigen::RowVectorXd& shifts, const Matrix& left_inside) const;

  const Problem& problem_;
  SampledErrors errors_;
  bool has_event_ = false;
  Event event_;
  double last_event_ = -std::numeric_limits<double>::infinity();
  Eigen::RowVectorXd shifts_;  // of the last event, by each error
  SignedErrorBounds x_, y_, w_, outputs_;
  Vector overlooked_y_;  // the largest y_size
  Vector hidden_y_;      // the largest y_hidden
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_ERROR_GROWTH_H_
