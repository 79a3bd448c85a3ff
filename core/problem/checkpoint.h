// SPDX-License-Identifier: Apache-2.0
// A solve that is interrupted and goes on, with the same bits as one that was not.

#ifndef DLCS_CORE_PROBLEM_CHECKPOINT_H_
#define DLCS_CORE_PROBLEM_CHECKPOINT_H_

#include <string>

#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// What stands fast of a solve under way. Made at the end of windows, and of blocks of steps in marches.
struct Checkpoint {
  double time;  // solved up to here
  // Columns first ... first + count - 1 of `solution` (times, x, y, w, left_limits) have come since the checkpoint
  // before and will not change any more. Perhaps none.
  const Solution& solution;
  Index first;
  Index count;
  std::string state;  // for ResumePoint
};

// Where to go on: the state of a checkpoint, and the columns of the trajectory up to it, perhaps more.
struct ResumePoint {
  std::string state;
  Matrix x;  // m × columns
  Matrix y;  // n × columns
  Matrix w;  // n × columns
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_CHECKPOINT_H_
