// SPDX-License-Identifier: Apache-2.0
// Switching times located, high order between them.

#ifndef DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_H_
#define DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_H_

#include "core/context/solve_context.h"

namespace dlcs {

// The error where none is asked for, and the largest: beyond, the estimates mean nothing.
inline constexpr double kDefaultEventTolerance = 1e-9;
inline constexpr double kLargestEventTolerance = 0.1;

// Of Options::kMostDefaultSteps, the part that is for event location; the rest is for steps without events where it
// does not come to T.
inline constexpr Index kMostDefaultEventWork = 18'900;

// Follows the system from mode to mode. In a mode (core/event_driven/mode.h) the system is a linear differential
// equation, solved by collocation of degree 12 with the step that the tolerance allows
// (core/event_driven/mode_step.h, smooth_step.h); the mode ends where the first guard crosses zero, located to
// rounding on the polynomials; the next one is proposed by a coupled LCP (core/event_driven/mode_search.h) and
// taken if it lasts. Where none lasts, because modes accumulate (Zeno) or do not determine y (relative degree
// above one), coupled steps of first order carry on, as short as the tolerance asks, until one does. States
// jump where StartInterval() says.
//
// The tolerance is options.error_tolerance, or kDefaultEventTolerance: the error asked for in x, relative to the
// largest value of each component so far; y and w meet it relative to theirs. Steps are estimated from the decay of
// coefficients, and what becomes of their errors and of rounding by core/event_driven/error_growth.h; where that is
// more than the tolerance, the solve is repeated, up to two times, with smaller errors. The trajectory goes to
// context.recorder at the nodes of context.grid, whose steps do not matter otherwise, and with options.keep_pieces the
// polynomials to Solution::pieces. Switching times, accuracy, certificate and cost go to the solution. Returns false
// where the solve ended before T, or at T with an estimated error above options.error_tolerance; the solution says why.
// One thread, the stop token looked at every step. Cost: 25 m³ for each active set that occurs, and for each step some
// 14 values of f and g and 100 m² operations.
bool EventDriven(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_H_
