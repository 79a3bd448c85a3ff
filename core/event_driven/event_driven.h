// SPDX-License-Identifier: Apache-2.0
// The event-driven method: locates switching times, with steps of high order between them.

#ifndef DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_H_
#define DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_H_

#include <algorithm>
#include <cstddef>

#include "core/context/solve_context.h"

namespace dlcs {

// The error tolerance if the options set none, and the largest one: above it the estimates are not reliable.
// EventDrivenTest feels both.
inline constexpr double kDefaultEventTolerance = 1e-9;
inline constexpr double kLargestEventTolerance = 0.1;

// The part of Options::kMaxDefaultSteps for event_driven; the rest is for steps without events if it does not reach T.
inline constexpr Index kMaxDefaultEventWork = 27'800;
// Its work for the default tolerance, in steps: that for each 1,000 output times, since who asks for many means a long
// solve, such as a circuit with as many cycles. Each break point begins a mode, and others follow.
inline Index MaxDefaultEventWork(std::size_t output_times, std::size_t break_points) {
  constexpr Index kOfABreakPoint = 600;
  return std::max<Index>(1, static_cast<Index>(output_times) / 1000) * kMaxDefaultEventWork +
         kOfABreakPoint * static_cast<Index>(break_points);
}

// Follows the system from mode to mode. In a mode (core/event_driven/mode.h) the system is a linear differential
// equation, solved by collocation of degree 12 with the step that the tolerance allows (core/event_driven/mode_step.h,
// smooth_step.h); the mode ends where the first guard crosses zero, located to rounding on the polynomials; the next
// one is proposed by a coupled LCP (core/event_driven/mode_search.h) and taken if it lasts. If none lasts, because
// modes accumulate (Zeno) or do not determine y (relative degree above one), coupled steps of first order, as short as
// the tolerance requires, are taken until one does. StartInterval() decides where states jump.
//
// The tolerance is options.error_tolerance, or kDefaultEventTolerance. It bounds the error of x relative to the largest
// value of each component so far, and that of y and w likewise. The local error of a step is estimated from the decay
// of its coefficients, the global error by core/event_driven/error_growth.h. If the latter is above the tolerance, the
// solve is repeated with smaller local errors, at most twice, or five times if they are short; the best one counts. The
// trajectory is recorded at the nodes of context.grid, whose steps are not used otherwise; with options.keep_pieces the
// polynomials are stored in Solution::pieces. Sets switching times, accuracy, certificate and cost of the solution.
// Returns false if the solve ended before T, or at T with an estimated error above options.error_tolerance; the
// solution says why. One thread; the stop token is checked in every step. Cost: 25 m³ for each active set that occurs,
// and about 14 values of f and g and 100 m² operations for each step.
bool EventDriven(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_H_
