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

// Two times are one node if they are closer than this fraction of a step, and of their distance from the break point
// before them: in a layer behind it, the solution may change within a tiny part of a step.
inline constexpr double kSameNode = 1e-9;

struct Grid {
  std::vector<Run> runs;
  std::vector<double> times;        // of all nodes; a break point is one node (methods see both its limits)
  std::vector<Index> output_nodes;  // increasing
  double longest_step = 0;

  Index num_steps() const { return static_cast<Index>(times.size()) - 1; }
};

// The grid for [0, horizon]. Each smooth interval between `break_points` (inside (0, horizon), increasing) is divided
// into equal steps no longer than the options' step. An output time that is not a node then splits its interval, and
// both parts are divided again. An output time within 1e-9 steps of a node is that node, unless the node is 0 or a
// break point.
//
// With options.grid_times the nodes are those times, 0, `horizon`, the break points and the output times. Of times that
// agree to rounding only one is a node: a break point is preferred to an output time, and that to a grid time.
// Consecutive steps whose lengths agree to rounding make one run. `options` must have passed Validate().
Grid MakeGrid(double horizon, const std::vector<double>& break_points, const Options& options);

// The number of steps that MakeGrid() would make. Allocates nothing, so it can be called before a request is refused.
double CountSteps(double horizon, const std::vector<double>& break_points, const Options& options);

// The same grid with every step halved; output nodes stay at their times.
Grid Halve(const Grid& grid);

// A second grid, to estimate the error of a solve on `grid` by comparison. Between two break points it has every
// `factor`-th node of `grid`, and one shorter step at the end if the number of steps is not a multiple. If there are
// fewer than four steps, each is divided into `factor` steps instead, so that every step differs. Output nodes of
// `grid` stay nodes if they are few. All nodes are output nodes if there are at most `most_outputs`; otherwise a subset
// at even distances, and the remaining output nodes of `grid`.
Grid WithOtherSteps(const Grid& grid, Index factor, Index most_outputs);

// The columns of a matrix with one column per node and run: sources may jump where two runs meet, so that node has two
// columns, the last of one run and the first of the next.
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
