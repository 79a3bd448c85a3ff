// SPDX-License-Identifier: Apache-2.0
// A piece of a trajectory over consecutive steps of one length, with its sources.

#ifndef DLCS_CORE_DISCRETIZATION_SEGMENT_H_
#define DLCS_CORE_DISCRETIZATION_SEGMENT_H_

#include "core/types.h"

namespace dlcs {

struct Segment {
  Index first_node = 0;
  Index steps = 0;
  double step = 0;
  // Columns are the nodes 0..steps, with the limits from inside the segment.
  Matrix f, g, x, y;
  // Columns are the midpoints of the steps 0..steps-1.
  Matrix f_mid, g_mid;
  // False if y at node 0 was copied from the first step, because node 0 has no LCP of its own (index one, skew M).
  bool first_y_is_solution = true;

  // Drops everything after the first `kept` steps.
  void Truncate(Index kept) {
    steps = kept;
    for (Matrix* columns : {&f, &g, &x, &y}) columns->conservativeResize(Eigen::NoChange, kept + 1);
    for (Matrix* columns : {&f_mid, &g_mid}) columns->conservativeResize(Eigen::NoChange, kept);
  }
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_SEGMENT_H_
