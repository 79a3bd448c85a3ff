// SPDX-License-Identifier: Apache-2.0
// The columns of a whole grid, with one for each limit where runs meet.

#ifndef DLCS_CORE_DISCRETIZATION_NODE_COLUMNS_H_
#define DLCS_CORE_DISCRETIZATION_NODE_COLUMNS_H_

#include "core/discretization/grid.h"

namespace dlcs {

// Sources may jump where runs meet, so such a node has two columns, the last of one run and the first of the next.
class NodeColumns {
 public:
  // `grid` must outlive it.
  explicit NodeColumns(const Grid& grid) : grid_(grid) {}

  Index Of(size_t run, Index step) const { return grid_.runs[run].first_node + static_cast<Index>(run) + step; }
  Index First(size_t run) const { return Of(run, 0); }
  Index Count(size_t run) const { return grid_.runs[run].steps + 1; }
  Index CountAll() const { return First(grid_.runs.size() - 1) + Count(grid_.runs.size() - 1); }

  double Time(Index column) const {
    size_t run = grid_.runs.size() - 1;
    while (run > 0 && column < First(run)) --run;
    return grid_.times[grid_.runs[run].first_node + column - First(run)];
  }

 private:
  const Grid& grid_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_NODE_COLUMNS_H_
