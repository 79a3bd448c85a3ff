// SPDX-License-Identifier: Apache-2.0
// The active sets over time, and the intervals solved without one.

#ifndef DLCS_CORE_EVENT_DRIVEN_EVENT_RECORD_H_
#define DLCS_CORE_EVENT_DRIVEN_EVENT_RECORD_H_

#include <string>
#include <vector>

#include "core/problem/accuracy.h"
#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// An interval with one active set, or one solved by coupled steps of first order.
struct ModeInterval {
  double begin = 0;
  double end = 0;
  double begin_error = 0;     // how far the begin may be off
  std::vector<Index> active;  // increasing; the indices with w_i = 0 while y_i may be positive
  bool coupled = false;       // by coupled steps of first order, because no mode lasted; `active` is empty
  std::string why;            // why coupled steps were needed; empty for a mode
};

struct EventRecord {
  std::vector<ModeInterval> intervals;  // one after the other from 0 on
  Index steps = 0;                      // inside modes, accepted
  Index rejected_steps = 0;             // too long for the tolerance
  Index coupled_steps = 0;
  Index modes_made = 0;
  double longest_step = 0;
  TrajectoryErrors errors;

  // The work so far, in steps of an exponential integrator for the same system with `num_states` states. It is computed
  // from counts, with measured weights, so that it does not depend on the machine.
  Index Work(Index num_states) const;
  static constexpr Index kOfASmoothStep = 33;
  // A solve that advances so evenly that it will reach T within so many times the work allowed may continue: many short
  // modes do not mean that it will not end.
  static constexpr Index kPatience = 8;

  // `next` begins where the last interval ends, and lengthens it where nothing changes.
  void Add(ModeInterval next);
};

// The start of the first interval, and the times where one follows another.
std::vector<SwitchingTime> SwitchingTimesOf(const EventRecord& record, const std::vector<double>& break_points,
                                            const std::vector<StateJump>& jumps);

// A sentence on the intervals that were solved by coupled steps; empty if there were none.
std::string DescribeCoupledSteps(const EventRecord& record);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_EVENT_RECORD_H_
