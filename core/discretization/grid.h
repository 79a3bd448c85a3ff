// SPDX-License-Identifier: Apache-2.0
// The nodes in time: uniform runs between break points, output times among the nodes.

#ifndef DLCS_CORE_DISCRETIZATION_GRID_H_
#define DLCS_CORE_DISCRETIZATION_GRID_H_

#include <vector>

#include "core/problem/options.h"
#include "core/types.h"

namespace dlcs {

// Consecutive steps of one length.
struct Run {
  Index first_node = 0;
  Index steps = 0;
  double begin = 0;
  double end = 0;
  double step = 0;
  bool starts_at_break = false;  // at 0 or at a break point: f and g may jump here, and so may the state
};

struct Grid {
  std::vector<Run> runs;
  std::vector<double> times;        // of all nodes; a break point is one node (methods see both its limits)
  std::vector<Index> output_nodes;  // increasing
  double longest_step = 0;

  Index num_steps() const { return static_cast<Index>(times.size()) - 1; }
};

// The grid for [0, horizon]: each smooth interval between `break_points` (inside (0, horizon), increasing) is cut into
// equal steps no longer than the options' step; an output time that is no node then splits its smooth interval, and
// both parts are cut anew. An output time within 1e-9 steps of a node is that node.
//
// With options.grid_times these are the nodes, and 0, `horizon`, the break points and the output times besides; of
// times that agree to rounding one is a node, a break point before an output time before a grid time. Consecutive steps
// that agree to the rounding of their times make one run. `options` must have passed Validate().
Grid MakeGrid(double horizon, const std::vector<double>& break_points, const Options& options);

// The steps that MakeGrid() would take, counted without making them: of what is asked for in vain, no node is stored.
double CountSteps(double horizon, const std::vector<double>& break_points, const Options& options);

// The same grid with every step halved; output nodes stay at their times.
Grid Halve(const Grid& grid);

// A grid to compare `grid` with. Between two break points it has every `factor`-th node, and at the end one shorter
// step where their number does not fit; where the steps are fewer than four, each is cut into `factor` instead: a step
// that stays as it is shows nothing. Output nodes that are few among many stay nodes. All nodes are output nodes, up to
// `most_outputs`; of more, those at even distances and those of `grid` that are left.
Grid WithOtherSteps(const Grid& grid, Index factor, Index most_outputs);

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

#endif  // DLCS_CORE_DISCRETIZATION_GRID_H_
