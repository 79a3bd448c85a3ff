// SPDX-License-Identifier: Apache-2.0
// One step inside a mode: how accurate it is, and how far the mode lasts.

#ifndef DLCS_CORE_EVENT_DRIVEN_SMOOTH_STEP_H_
#define DLCS_CORE_EVENT_DRIVEN_SMOOTH_STEP_H_

#include <limits>
#include <memory>
#include <optional>

#include "core/discretization/step_sources.h"
#include "core/event_driven/mode.h"
#include "core/event_driven/mode_step.h"

namespace dlcs {

// The sizes that errors are compared with: the largest values of each component so far. Components have units
// of their own.
struct Magnitudes {
  Vector x;
  Vector y;
  Vector w;
  // What x may come to be in a short time, in the units of each component. What is zero at the start and grows like a
  // high power of time never is accurate in itself: a tiny part of this counts as accurate.
  Vector x_reach;
  // What rounding has done to x on the step before. A fast state forgets it at once, in a layer that is no error.
  Vector x_noise;
};

// x, y and the guards of `mode` on a step, as polynomials in s.
struct SmoothStep {
  LegendreSeries x;
  LegendreSeries y;
  LegendreSeries guard;
  // How far below zero a guard must fall to end the mode: a millionth of the tolerance relative to its size
  // on this step, but no less than its rounding and its estimated error.
  Vector guard_level;
  // The largest ratio of estimated error to allowed error, over all components of x and of the guards; the
  // step is accurate where it is at most 1. Errors fall with the power K of the length.
  double error_ratio = 0;
  // Where layers of fast states make it more: how long a step may be that resolves them; else infinite.
  double layer_length = std::numeric_limits<double>::infinity();
  // What it was made from: estimated errors, and what rounding does.
  Vector x_error, guard_error;
  Vector x_noise, guard_noise;
  Vector x_tail, guard_tail;  // of the errors, what is there all over the step but at its end
  Vector x_rounding;   // of this step alone
  Vector guard_terms;  // the sum of the sizes of what each guard is summed from
  // Of the step of full length: how errors go on.
  std::shared_ptr<const ModeStepper> stepper;
  // What x' may be off by: the sources miss so much; and the rounding of its terms, the data among them.
  Vector slope_error, slope_noise;
};

// How far two polynomials of the sources may be apart where one step ends and the next begins: an event is
// located on the polynomial of the one, and the guards of the other start from its own.
struct SourceGap {
  Vector f;
  Vector g;
  Vector slope;
};
SourceGap GapOf(const StepSources& sources);

// Solves x' = Âx + b from `start` on the step of `sources`. The error of a component is estimated from its
// last coefficients, by going on with their decay, and from what the sources miss at the checked time.
// Allowed is, for x, tolerance times its magnitude times `share`, the part of the horizon that this step is;
// for the guards (y and w, which hold no memory) tolerance times their magnitude; and what rounding does,
// always. Every size is that of one component, or of the terms of one row. `gap`, null or that of the step before,
// raises the levels of the guards.
SmoothStep TakeSmoothStep(const Mode& mode, const Eigen::Ref<const Vector>& start, const StepSources& sources,
                          const Magnitudes& magnitudes, double tolerance, double share, const SourceGap* gap);

// The error ratio where the step is cut at `s`, against the sizes up to there alone: in a mode that an event ends x may
// grow beyond all that the solution is. The other arguments are those of TakeSmoothStep().
double ErrorRatioBefore(double s, const Mode& mode, const SmoothStep& step, const Magnitudes& magnitudes,
                        double tolerance, double share);

// The first time that a guard of the step falls below its level.
struct ModeEnd {
  double s = 1;
  Index guard = 0;
};
std::optional<ModeEnd> FindModeEnd(const SmoothStep& step);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_SMOOTH_STEP_H_
