// SPDX-License-Identifier: Apache-2.0
// A piece of trajectory over consecutive steps of one length, with the sources it was made from.

#ifndef DLCS_CORE_DISCRETIZATION_SEGMENT_H_
#define DLCS_CORE_DISCRETIZATION_SEGMENT_H_

#include "core/types.h"

namespace dlcs {

struct Segment {
  Index first_node = 0;
  Index steps = 0;
  double step = 0;
  // Columns are the nodes 0..steps; the limits from inside the segment are meant.
  Matrix f, g, x, y;
  // Columns are the midpoints of the steps 0..steps-1.
  Matrix f_mid, g_mid;
  // False where y at node 0 is only borrowed from the first step (no LCP of its own: index one, skew M).
  bool first_y_is_solution = true;

  // Forgets everything after `kept` steps.
  void Truncate(Index kept) {
    steps = kept;
    for (Matrix* columns : {&f, &g, &x, &y}) columns->conservativeResize(Eigen::NoChange, kept + 1);
    for (Matrix* columns : {&f_mid, &g_mid}) columns->conservativeResize(Eigen::NoChange, kept);
  }
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_SEGMENT_H_
