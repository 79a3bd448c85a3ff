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
#include "core/event_driven/smooth_step.h"
#include "core/problem/accuracy.h"
#include "core/problem/problem.h"

namespace dlcs {

// Estimates the errors of the solution by integrating error equations beside it. In a mode an error e obeys
// e' = Â e + d. At an event at which x' jumps, an error moves the time of the event, so e jumps too. Near an event the
// solution is compared up to that shift in time: where a fast state settles, or y falls to zero within picoseconds,
// the difference at one time shows nothing but the shift. Errors of both causes are integrated by the same steps as the
// solution:
//
// - truncation: d is the interpolation error of the sources, and what events that were overlooked do. A bound has the
//   signs of e, so that all contributions add up. Another error has the signs that it has inside each step, and adds up
//   over the steps: where that leaves no more than rounding, as in a state that is zero by symmetry, there is none.
// - rounding: d holds an ulp of every term of x', including one of every entry of the data, whose signs are not known.
//   Three samples are taken, with the signs of e, constant ones, and pseudo-random ones in each step; the largest
//   counts.
//
// To these come the local errors of the steps. Cost: five solves of a step without refinement, for each step.
class ErrorGrowth {
 public:
  // Keeps a reference. The sizes at x0 are the first ones.
  explicit ErrorGrowth(const Problem& problem);

  // Integrates over `step` up to the position `s_end`. `overlooked` is caused by guards that are below zero but not
  // below their levels: an error of x', one of x where the mode holds x back, one of y and one of w.
  struct Overlooked {
    Vector slope;
    Vector x;
    Vector y;
    Vector w;
  };
  struct OverlookedByCause {
    Overlooked truncation, rounding;
    Overlooked with_signs;  // truncation with the signs that it has
    Vector y_size;          // that y may have had where an event was overlooked
  };
  // `guard`: the one that ends the mode at `s_end`, if one does. Returns how far the time of that event may be off.
  double AddStep(const SmoothStep& step, const StepSources& sources, const OverlookedByCause& overlooked, double s_end,
                 std::optional<Index> guard);
  // A break point of the sources at the end of `step`, whose time may be off by `rounding`.
  void AddBreak(const SmoothStep& step, const StepSources& sources, double rounding);
  // Adds what x may be off by at the time reached, by rounding.
  void AddRounding(const Vector& amount);
  // The errors so far in the guards of `mode`.
  ErrorBounds InGuards(const Mode& mode) const;
  // Those of each state, both causes together.
  Vector InState() const;
  // Adds the error of a step of first order, which was estimated elsewhere; the state was off by `inside` on it.
  void Add(const Vector& error, const Vector& inside);
  // Of that step, how far w is off inside of it.
  void AddInside(const Vector& of_w);

  // The largest errors so far of each component, and the sizes in `sizes`.
  TrajectoryErrors Errors(const Magnitudes& sizes) const;

 private:
  static constexpr Index kSamples = 3;  // of rounding
  // The columns of errors_ behind them.
  static constexpr Index kTruncation = kSamples, kWithSigns = kSamples + 1;
  static constexpr Index kErrors = kSamples + 2;

  // An event or a break point, at position `s` of the step that led to it, after which x' is not known yet.
  struct Event {
    LegendreSeries x;
    double length;
    double s;
    bool is_break = false;
    Vector slope;
    Vector y, w, outputs;
    std::array<double, kErrors> delay;
  };
  void Pass(const SmoothStep& step, const StepSources& sources);
  void BeginJump(const SmoothStep& step, const StepSources& sources, double s);
  // What jumps of y, w and outputs come to by the error of the time of the event.
  void RaiseJumps(const SmoothStep& step);
  // How far the time of the event may be off.
  SignedErrorBounds Delays() const;
  double BeginEvent(const SmoothStep& step, const StepSources& sources, double s_end, Index guard);
  // The signs that the error with this index is given, where it has those of `values`.
  Vector Signs(Index error, const Eigen::Ref<const Vector>& values) const;
  // Adds `amount` to the error with this index, with the signs that it is given.
  void AddTo(Index error, const Vector& amount);
  // The sizes of the errors in the columns; rounding is the largest sample.
  static SignedErrorBounds SizesOf(const Matrix& errors);
  // The errors of y and w for those of x at the end of the step. What fast states make of them at its begin decays at
  // once. `slope_at` makes slopes of polynomials; `shifts` are the times that excuse the errors; `left_inside` is what
  // the refinement left of x at some times of the step, or empty where an event cuts it.
  void RaiseOutputs(const SmoothStep& step, const LegendreVector& slope_at, const Eigen::RowVectorXd& shifts,
                    const OverlookedByCause& overlooked, const Matrix& left_inside);

  SignedErrorBounds InRows(const LinearOutput& output, const StepRows& rows, const LegendreVector& slope_at,
                           const Eigen::RowVectorXd& shifts, const Matrix& left_inside) const;

  const Problem& problem_;
  Matrix errors_;  // one a column
  Matrix slopes_;  // their derivatives at the end of the last step, if its mode is not explicit
  bool has_event_ = false;
  Event event_;
  double last_event_ = -std::numeric_limits<double>::infinity();
  Eigen::RowVectorXd shifts_;  // of the last event, by each error
  unsigned steps_ = 0;
  SignedErrorBounds x_, y_, w_, outputs_;
  Vector overlooked_y_;  // the largest y_size
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_ERROR_GROWTH_H_
