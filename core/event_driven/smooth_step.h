// SPDX-License-Identifier: Apache-2.0
// One step inside a mode, with its estimated error.

#ifndef DLCS_CORE_EVENT_DRIVEN_SMOOTH_STEP_H_
#define DLCS_CORE_EVENT_DRIVEN_SMOOTH_STEP_H_

#include <limits>
#include <memory>
#include <vector>

#include "core/discretization/error_bounds.h"
#include "core/discretization/step_sources.h"
#include "core/event_driven/magnitudes.h"
#include "core/event_driven/mode.h"
#include "core/event_driven/mode_step.h"

namespace dlcs {

// Linear functions of the solution on a step, as polynomials in s.
struct StepRows {
  LegendreSeries values;
  ErrorBounds error;          // inside the step
  Vector tail;                // the part of the truncation that vanishes at the end
  Vector source_slope_noise;  // the part of the rounding that slopes of sources have; empty where no row depends on x'
  Vector terms;               // the sum of the absolute values of the terms
};

// x, y, the guards of `mode` and the outputs (without their sources h) on a step, as polynomials in s.
struct SmoothStep {
  LegendreSeries x;
  LegendreSeries y;
  StepRows guard;
  StepRows outputs;
  // How far below zero a guard must fall to end the mode: a millionth of the tolerance relative to its size on this
  // step, but at least its rounding and its estimated error.
  Vector guard_level;
  Vector guard_allowed;  // the error of each guard that the tolerance allows, and its rounding
  // The largest ratio of estimated error to allowed error, over all components of x and of the guards; the
  // step is accurate where it is at most 1. Errors fall with the power K of the length.
  double error_ratio = 0;
  // If boundary layers of fast states make error_ratio larger than 1: the step length that resolves them; else
  // infinite. `small_layer_length` also resolves layers that may be rounding, of which shorter steps have more.
  double layer_length = std::numeric_limits<double>::infinity();
  double small_layer_length = std::numeric_limits<double>::infinity();
  ErrorBounds x_error;           // inside the step
  Vector layer;                  // of each state the size of the boundary layer that the step leaves out
  Vector x_unsettled;            // the part of the truncation and of the layer that may be rounding
  Vector x_tail;                 // the part of the truncation that vanishes at the end
  LegendreSeries left;           // what the refinement of x left, with its signs
  Vector x_hidden;               // last coefficients that may be rounding, and were taken for no sign of x_tail
  StateRounding rounding{0};     // of this step alone; the bound holds inside of it, too
  std::vector<Index> unreached;  // as ModeStepper::Solution::unreached
  // For the step of full length, with its mode: propagates errors.
  std::shared_ptr<const ModeStepper> stepper;
  // Of the equations of the mode: from the interpolation of the sources, and from an ulp in every entry of the data.
  SignedErrorBounds row_error;
  Vector x_size;      // a bound of |x|
  Vector slope_size;  // for each state the size of the terms of x'
};

// An event at `s` cuts the step: limits its sizes, and rounding with them, to those up to there. Behind the event x of
// the old mode may grow far beyond the solution.
void LimitSizes(const StepSources& sources, double s, SmoothStep& step);

// x' of the polynomials at `s`.
Vector SlopeAt(const SmoothStep& step, const StepSources& sources, double s);

// What polynomials miss at an event inside a step. The event is located on them, but the guards of the next step start
// from its own.
struct EventGap {
  Vector x;
  Vector f;
  Vector g;
};
EventGap GapOf(const SmoothStep& step, const StepSources& sources);

// Solves x' = Âx + b from `start` on the step of `sources`, by a stepper of its length. The error of a component is
// estimated by extrapolating the decay of its coefficients, and from the interpolation error of the sources at the
// checked time. The allowed error of x is tolerance · magnitude · `share`, the fraction of the horizon that this step
// covers; that of the guards (y and w, whose errors do not accumulate) is tolerance · magnitude. Rounding errors are
// always allowed. Every size belongs to one component, or to the terms of one row. `gap`, null or from the step before,
// raises the levels of the guards.
SmoothStep TakeSmoothStep(std::shared_ptr<const ModeStepper> stepper, const Eigen::Ref<const Vector>& start,
                          const StepSources& sources, const Magnitudes& magnitudes, double tolerance, double share,
                          const EventGap* gap);

// The polynomials at some positions up to `s`, one a column.
Eigen::Matrix<double, kLegendreSize, 5> LooksBefore(double s);

// The error ratio if the step is cut at `s`, with the sizes up to there only: after the event that ends the mode, its
// polynomials may grow far beyond the solution. The other arguments are those of TakeSmoothStep().
double ErrorRatioBefore(double s, const Mode& mode, const SmoothStep& step, const Magnitudes& magnitudes,
                        double tolerance, double share);

// Projects `x` onto the constraints that the mode imposes on the state at the begin of the step of `sources`: rounding,
// or an error of an earlier step, may have moved it off them. Returns false, and changes nothing, if it is farther off
// than the tolerance allows.
bool Project(const Mode& mode, const StepSources& sources, double tolerance, Magnitudes& magnitudes, Vector& x);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_SMOOTH_STEP_H_
