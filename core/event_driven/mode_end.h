// SPDX-License-Identifier: Apache-2.0
// Where the guards of a step end its mode, and which events a step may have overlooked.

#ifndef DLCS_CORE_EVENT_DRIVEN_MODE_END_H_
#define DLCS_CORE_EVENT_DRIVEN_MODE_END_H_

#include <optional>

#include "core/event_driven/error_growth.h"
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

// What guards up to `s_end` may have overlooked: where they are below zero but above their levels, or nearer to zero
// than their own error and `error_of_state`, the one that the error of the state makes. An active y_i < 0 should be
// zero. A w_i < 0 should have made its pair active: y_i would be about w_i / M_ii; where M_ii = 0, y_i would have kept
// x on the constraint. If a constraint should have been released earlier, the error of x is what its y causes until
// then, at most over `duration`; for a fast state, it is the value to which the state settles.
ErrorGrowth::Overlooked OverlookedEvents(const Problem& problem, const SmoothStep& step, const Vector& error_of_state,
                                         double s_end, double duration);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MODE_END_H_
