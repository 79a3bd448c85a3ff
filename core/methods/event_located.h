// SPDX-License-Identifier: Apache-2.0
// Switching times located, high order between them.

#ifndef DLCS_CORE_METHODS_EVENT_LOCATED_H_
#define DLCS_CORE_METHODS_EVENT_LOCATED_H_

#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/methods/solve_context.h"
#include "core/observer.h"
#include "core/options.h"
#include "core/problem.h"
#include "core/solution.h"

namespace dlcs {

// One active set from `begin` to `end`, or a stretch that was marched.
struct ModeInterval {
  double begin = 0;
  double end = 0;
  std::vector<Index> active;  // increasing; the indices with w_i = 0 while y_i may be positive
  bool marched = false;       // by coupled steps of first order, because no mode lasted; `active` is empty
  std::string why;            // of a march
};

// What EventLocated() tells beside the trajectory.
struct EventRecord {
  std::vector<ModeInterval> intervals;  // one after the other from 0 on
  Index steps = 0;                      // inside modes, accepted
  Index rejected_steps = 0;             // too long for the tolerance
  Index marched_steps = 0;
  Index events = 0;
  Index modes_made = 0;  // Schur forms
  Index lcps = 0;
  Index source_evaluations = 0;  // times at which f and g were evaluated
  // Sum over all steps of the estimated local error over its magnitude: what the tolerance bounds while every
  // step could be made short enough.
  double accumulated_error = 0;

  // The ends of all intervals but the last: where the active set changed.
  std::vector<double> SwitchingTimes() const;
};

// Follows the system from mode to mode. In a mode (core/events/mode.h) the system is a linear differential
// equation, solved by collocation of degree 12 with the step that `tolerance` allows
// (core/events/mode_step.h, smooth_step.h); the mode ends where the first guard crosses zero, located to
// rounding on the polynomials; the next one is proposed by a coupled LCP (core/events/mode_search.h) and
// taken if it lasts. Where none lasts, because modes accumulate (Zeno) or do not determine y (relative degree
// above one), coupled steps of first order carry on, as short as the tolerance asks, until one does. States
// jump where StartStretch() says.
//
// `tolerance`  the error asked for in x, relative to the largest value of each component so far, at least
// 1e-13; y and w
//              meet it relative to theirs. Estimated from the decay of coefficients, per unit of time.
// The trajectory goes to context.recorder at the nodes of context.grid, whose steps do not matter otherwise;
// the certificate to `certificate`, its midpoints being times inside the steps. Returns false where the solve
// ended before T; the solution says why. One thread, the stop token looked at every step. Cost: 25 m³ for
// each active set that occurs, and for each step some 14 values of f and g and 24 m² operations.
bool EventLocated(SolveContext& context, double tolerance, EventRecord& record, Certificate& certificate);

struct EventSolution {
  Solution solution;
  EventRecord record;
};

// Solves `problem` by EventLocated(), with the output times, grid and projection of `options`; without a
// number of steps the nodes are the output times, 0 and T alone. What every method refuses is refused
// (relative degree two and more). Errors: InvalidArgument as Solve(), for a tolerance outside [1e-13, 0.1],
// and for rules whose solution a mode does not determine (least norm, minimisers, hidden least elements).
absl::StatusOr<EventSolution> SolveByEvents(const Problem& problem, double tolerance, const Options& options,
                                            Observer& observer, std::stop_token stop);

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_EVENT_LOCATED_H_
