// SPDX-License-Identifier: Apache-2.0
// Short steps where components of all rates start to move, and longer ones behind.

#ifndef DLCS_CORE_DISCRETIZATION_GRADED_GRID_H_
#define DLCS_CORE_DISCRETIZATION_GRADED_GRID_H_

#include <vector>

#include "core/discretization/grid.h"
#include "core/discretization/sources.h"
#include "core/problem/problem.h"

namespace dlcs {

// The times where components of all rates may start to move: 0, and the break points where f or g jumps if there are at
// most 256 break points. More of them leave no room for short steps behind each.
std::vector<double> LayerTimes(const Problem& problem, Sources& sources);

// A step that resolves the fastest component: 1 / (4 max_i ‖A_i‖₁ / |E_ii|) over the rows i. Infinite if A is 0.
double FastestStep(const Problem& problem);

// The length of steps behind a layer grows by this factor from level to level.
inline constexpr Index kRatioOfLevels = 4;
// At this distance from a layer, in steps, a step may be that long.
inline constexpr Index kStepsBehindLayer = 2;
// A level reaches from there to where the next longer step is allowed.
inline constexpr Index kStepsOfALevel = (kRatioOfLevels - 1) * kStepsBehindLayer;

// `grid` with shorter steps behind each of `layers`, which are increasing and starts of smooth intervals: steps are no
// longer than half the distance from the layer, or `shortest`. The lengths of runs are divided by powers of four, so
// that layers of many scales take a number of steps, and of lengths, that grows with the logarithm of their ratio. At
// most `most_steps` steps are added: if there would be more, the shortest steps are left out. Every node stays.
Grid GradeBehind(const Grid& grid, const std::vector<double>& layers, double shortest, Index most_steps);

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_GRADED_GRID_H_
