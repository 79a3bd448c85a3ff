// SPDX-License-Identifier: Apache-2.0
// Controls the length of the steps inside modes.

#ifndef DLCS_CORE_EVENT_DRIVEN_STEP_LENGTH_H_
#define DLCS_CORE_EVENT_DRIVEN_STEP_LENGTH_H_

#include "core/event_driven/mode.h"
#include "core/event_driven/smooth_step.h"

namespace dlcs {

// Chooses the length of each step from the errors of those before, and from how long the last modes lasted.
class StepLength {
 public:
  StepLength(double horizon, double first) : horizon_(horizon), length_(first), last_mode_(horizon) {}

  // The last length that the tolerance allowed.
  double value() const { return length_; }
  // The length of the next step in `mode`, where `left` is the time to the next known kink: all of it, or at most half.
  double Next(const Mode& mode, double left) const;

  // The first step of a solve: by the fastest eigenvalue of its mode, which has no units but that of time.
  void BeginWith(const Mode& mode);
  // A step of `length` was accurate up to its end.
  void Accept(double length, double error_ratio);
  // The length with which to repeat a step of `length` that was not accurate; that in which a layer settles is
  // at least `shortest`.
  double AfterError(const SmoothStep& step, double length, double shortest);
  // A step is repeated with this length. Returns how many were repeated in a row.
  int Shorten(double length);
  // A mode ended that lasted so long.
  void EndMode(double lasted);
  // What came before was no mode, and lasted so long.
  void EndOther(double lasted) { last_mode_ = lasted; }
  void RaiseTo(double length);

  // Shorter steps at `t` are not worth a collocation, unless `mode` (null: none) has a rate for it.
  double ShortestStep(double t, const Mode* mode) const;
  // A mode that ends sooner does not last.
  double ShortestMode(double t, const Mode* mode) const;

 private:
  double Shortest(double t, const Mode* mode, double part) const;

  double horizon_;
  double length_;
  double last_mode_;           // how long it lasted
  int rejected_in_a_row_ = 0;  // steps
  double rejected_ratio_ = 0;  // SmoothStep::error_ratio of the last rejected step
  int of_one_length_ = 0;      // steps in a row that found no reason to grow
};

// Steps that are shorter than this part of the horizon are not worth a collocation, nor a step of first order.
// StepLengthTest feels it.
inline constexpr double kShortestStep = 1e-12;

// Before or behind an event, as a part of its time. StepLengthTest feels it.
inline constexpr double kNear = 1e-4;

// The part of the tolerance that a step of this length gets: error control never requires less than 2 %.
double ShareOfTolerance(double length, double horizon);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_STEP_LENGTH_H_
