// SPDX-License-Identifier: Apache-2.0
// Where the guards of a step end its mode, and which events a step may have overlooked.

#ifndef DLCS_CORE_EVENT_DRIVEN_MODE_END_H_
#define DLCS_CORE_EVENT_DRIVEN_MODE_END_H_

#include <cstddef>
#include <optional>
#include <vector>

#include "core/event_driven/sampled_errors.h"
#include "core/event_driven/smooth_step.h"
#include "core/problem/problem.h"

namespace dlcs {

// The first time that a guard of the step falls below its level.
struct ModeEnd {
  double s = 1;
  Index guard = 0;
};
std::optional<ModeEnd> FindModeEnd(const SmoothStep& step);

// Whether that guard starts at zero and falls at once, so that only its level keeps the mode alive.
bool FallsFromZero(const SmoothStep& step, const ModeEnd& end);

// Whether a guard starts below zero by so little that this may be the error of its polynomial, which is smaller on a
// shorter step.
bool StartsBelowByTruncation(const SmoothStep& step, Index guard);

// Raises the levels of guards that start below zero and rise at once, if they start below by no more than the error
// that is allowed of them or 64 of their levels: the errors of large terms of a guard may be more than its level.
void LetRisingGuardsStartBelow(SmoothStep& step);

// Where y_i drives w_i down, another solution with y_i > 0 may begin where w_i is zero to rounding, and rounding
// decides between the two. There p = -M_ii y_i obeys p' = w_i' + rate p. From such a begin of a step on, p is followed
// until it returns to zero or rounding has grown to the size of numbers, which may take several steps.
class RepelledStarts {
 public:
  explicit RepelledStarts(Index num_constraints) : starts_(static_cast<std::size_t>(num_constraints)) {}

  // Whether the pair is followed already, or w_i is less than `noise` at the begin of a step.
  bool MayBe(Index pair, const LegendreVector& w, double noise) const;
  // Follows w_i over a step up to `s_end`, from `noise` below it, with the rate in the time of s. Returns how far below
  // zero p is once it has grown, else 0.
  double Follow(Index pair, const LegendreVector& w, double rate, double noise, double s_end);
  // The pair is not repelled any more.
  void End(Index pair) { starts_[static_cast<std::size_t>(pair)] = {}; }

 private:
  struct Start {
    double p = 0;
    double age = 0;  // in the time 1/rate
  };
  std::vector<Start> starts_;
};

// What guards up to `s_end` may have overlooked: where they are below zero but above their levels, or nearer to zero
// than their own error and `of_state`, the errors that those of the state make. An active y_i < 0 should be zero. A w_i
// < 0 should have made its pair active: y_i would be about w_i / M_ii; where M_ii = 0, y_i would have kept x on the
// constraint. If a constraint should have been released earlier, the error of x is what its y causes until then, at
// most over `duration`; for a fast state, it is the value to which the state settles. What lasts less than `shortest`
// is within the error of the times of events. `magnitudes` and `repelled`: of the steps before.
OverlookedByCause OverlookedEvents(const Problem& problem, const SmoothStep& step, const ErrorBounds& of_state,
                                   const Magnitudes& magnitudes, double s_end, double duration, double shortest,
                                   RepelledStarts& repelled);

// What the dips below zero of polynomials make of x and y, relative to what is allowed of them, or relative to rounding
// where that is more. A shorter step has less of them where the ratio is above 1. A y_i that is zero so far may be
// allowed nothing else. The arguments are those of OverlookedEvents().
double RatioOfDips(const Problem& problem, const SmoothStep& step, const Magnitudes& magnitudes, double tolerance,
                   double s_end, double duration, double shortest);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MODE_END_H_
