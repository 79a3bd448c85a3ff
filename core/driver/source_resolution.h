// SPDX-License-Identifier: Apache-2.0
// Whether steps see what f and g do inside them.

#ifndef DLCS_CORE_DRIVER_SOURCE_RESOLUTION_H_
#define DLCS_CORE_DRIVER_SOURCE_RESOLUTION_H_

#include <functional>
#include <limits>
#include <string>

#include "core/context/component_errors.h"
#include "core/discretization/grid.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "core/problem/time_axis.h"
#include "core/types.h"

namespace dlcs {

// f and g at time t, or their limits from one side, one below the other; x and y are those of this column of the
// trajectory.
using SourcesAt = std::function<Vector(double t, Side side, Index column)>;

// How far f and g are, inside steps of `grid`, from the parabola through their values at the ends and the middle of the
// step, and where that is coarse, from the line through its ends, which is all that most methods see; relative to the
// largest value of each component, or to what that can move x and w by, whichever is smaller. Where a step is a
// multiple of the period of a source, all grids see the same values, and comparing them shows nothing. 64 steps, of
// large systems down to 16, are looked at, at times that no period has in common. The two that differ most do not
// count, since a source that is singular at single times is resolved elsewhere. `solution` has the trajectory on
// `grid`. Cost: five values of f and g for each step.
double UnresolvedSources(const Grid& grid, const Solution& solution, const SourcesAt& sources);

struct Unresolved {
  double part = 0;  // of each component, as UnresolvedSources()
  // By how much x and w are moved in cells of the formulas that are shorter than the steps (ResolvedCells), beyond the
  // parabolas of UnresolvedSources(): each x_i by the largest sum of the areas that steps miss, which it forgets at the
  // rate |A_ii|, per mass, each w_i by the largest value of g_i that they miss. And the same of all that f and g are
  // there. Empty if nothing is missed.
  ComponentValues missed = {}, all = {};
  double searched = std::numeric_limits<double>::infinity();  // until when
};

// Adds what is missed in cells, so that a pulse that lies between all nodes of all grids is not overlooked. Cost: 13
// values of f and g for each cell, of some 20 for each step.
void AddMissedPulses(const Grid& grid, const Problem& problem, const SourcesAt& sources, Unresolved& unresolved);

// Raises the error of `solution` to what is `unresolved`. If its part is larger than what is small enough to leave the
// rest to the comparison of solves, with a warning.
void CountUnresolved(const Unresolved& unresolved, Solution& solution);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_SOURCE_RESOLUTION_H_
