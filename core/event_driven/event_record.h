// SPDX-License-Identifier: Apache-2.0
// Which active set held when, and where none did.

#ifndef DLCS_CORE_EVENT_DRIVEN_EVENT_RECORD_H_
#define DLCS_CORE_EVENT_DRIVEN_EVENT_RECORD_H_

#include <string>
#include <vector>

#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// One active set from `begin` to `end`, or a smooth interval that was marched.
struct ModeInterval {
  double begin = 0;
  double end = 0;
  std::vector<Index> active;  // increasing; the indices with w_i = 0 while y_i may be positive
  bool marched = false;       // by coupled steps of first order, because no mode lasted; `active` is empty
  std::string why;            // of a march
};

struct EventRecord {
  std::vector<ModeInterval> intervals;  // one after the other from 0 on
  Index steps = 0;                      // inside modes, accepted
  Index rejected_steps = 0;             // too long for the tolerance
  Index marched_steps = 0;
  Index modes_made = 0;
  double longest_step = 0;
  // The largest estimated error of a component of x, relative to the size of the component: with the growth of
  // errors, and rounding.
  double accumulated_error = 0;
  Vector errors_x;  // of each component

  // What it took, in steps of an exponential integrator of the same system with `num_states`, as measured: by counts,
  // so that it does not depend on the machine.
  Index Work(Index num_states) const;

  // `next` begins where the last interval ends, and lengthens it where nothing changes.
  void Add(ModeInterval next);
};

// The start of the first interval, and the times where one follows another.
std::vector<SwitchingTime> SwitchingTimesOf(const EventRecord& record,
                                            const std::vector<double>& break_points,
                                            const std::vector<StateJump>& jumps);

// A sentence on the smooth intervals that were marched; empty where there were none.
std::string DescribeMarches(const EventRecord& record);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_EVENT_RECORD_H_
