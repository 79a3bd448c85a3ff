// SPDX-License-Identifier: Apache-2.0
// One step of a linear differential equation by collocation of high degree.

#ifndef DLCS_CORE_EVENTS_MODE_STEP_H_
#define DLCS_CORE_EVENTS_MODE_STEP_H_

#include "core/events/legendre.h"
#include "core/events/mode.h"

namespace dlcs {

// The polynomial x of degree K on [t, t + length] with x(t) = `start` that satisfies x' = Â x + b, Â =
// mode.dynamics, b = `source`, at the K right Radau points (the zeros of P_K - P_{K-1}).
//
// At the end of the step that is the Padé approximation (K-1, K) of the exponential, applied to start and
// source: exact to rounding for ‖Â‖ length up to about 6, L-stable for any. In between the error is of the
// size of the last coefficients, which tells whether the step was short enough. In the Schur form of Â each
// component is a scalar equation, whose coefficients obey a recurrence of three terms, since ∫P_k = (P_{k+1}
// - P_{k-1})/(2k+1): any length of step costs K m² operations and no factorization. Source: [Hairer 1996] E.
// Hairer, G. Wanner. Solving ordinary differential equations II. Sections IV.3 and IV.5.
LegendreSeries StepMode(const Mode& mode, const Eigen::Ref<const Vector>& start, const LegendreSeries& source,
                        double length);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENTS_MODE_STEP_H_
