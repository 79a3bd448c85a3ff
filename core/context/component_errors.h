// SPDX-License-Identifier: Apache-2.0
// How far two trajectories of one problem are apart, component by component.

#ifndef DLCS_CORE_CONTEXT_COMPONENT_ERRORS_H_
#define DLCS_CORE_CONTEXT_COMPONENT_ERRORS_H_

#include <vector>

#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// Of the sums whose rounding counts, on each of the numbers from which they are summed.
inline constexpr Index kOperationsOfSum = 32;

// One number for each state, and for each y_i and w_i where those are measured; empty otherwise.
struct ComponentValues {
  Vector x = {};
  Vector y = {};
  Vector w = {};

  // Raises each entry to `factor` times that of `other`, where that is larger; NaN if either is.
  void RaiseTo(const ComponentValues& other, double factor = 1);
  void operator+=(const ComponentValues& other);
  void operator*=(double factor);
  // The largest entry relative to that of `sizes`; NaN if one of them is.
  double LargestRelative(const ComponentValues& sizes) const;
};

// The largest absolute value of each component of `solution` on [0, T]. y and w are measured only with `y_counts`,
// which is set if y is a Lipschitz function of x.
ComponentValues SizesOf(const Problem& problem, const Solution& solution, bool y_counts);
// The same for a nonlinear problem: x alone.
ComponentValues SizesOf(const Solution& solution);

// The rounding of the terms that components of these sizes are summed from, over the time that x_i remembers them: T,
// or 1/|A_ii|. For problems that are not solved with perturbed data; y and w have at least that in others.
ComponentValues RoundingOfTerms(const Problem& problem, const ComponentValues& sizes);
ComponentValues RoundingOfTerms(const ComponentValues& sizes);

// The largest absolute differences of the components in `measured` at the times that both solutions have. Times within
// `apart` of an inner jump of either one are left out, since the two may be on different sides of it. Memory: a few
// columns.
ComponentValues DifferencesBetween(const Solution& a, const Solution& b, const ComponentValues& measured,
                                   double apart = 0);

// For the steps in which a pair switches, and for those after them, in which y settles: the largest change of (B y)_i
// from node to node times the length of the step, or times the memory of x_i where that is shorter. Of the states
// alone; the others are those of `sizes`, as zeros. Cost: a product with B for each such step.
ComponentValues SwitchChanges(const Solution& solution, const Problem& problem, const ComponentValues& sizes);

// What is left of the differences of two solves beyond the rounding of both.
ComponentValues Beyond(const ComponentValues& differences, const ComponentValues& rounding);

// The errors of a trajectory of these sizes. A component is itself off by its error, so an error e is e (1 + e/own) of
// the true size.
TrajectoryErrors ErrorsOf(const ComponentValues& sizes, const ComponentValues& truncation,
                          const ComponentValues& rounding);
// Raises the truncation of every component to this part of its size.
void RaiseTruncation(double part, TrajectoryErrors& errors);

// Raises the errors of y and w to what those of x make of them in the active sets at the nodes of `solution`, for y a
// function of x: where y depends much on x for a short time, no node that several grids have may show it. Of at most
// kMostSets sets, in the order of time, of dense problems. Cost: a factorization for each set.
inline constexpr int kMostSets = 64;
void RaiseToEffectOfStates(const Problem& problem, const Solution& solution, TrajectoryErrors& errors);

// Adds to the errors of x the rounding of what y adds in a step, and what the errors of w do in methods with steps:
// Certificate::w_missed, as truncation, and the rounding of N x, which has an ulp of x for each step that x_j
// remembers. As much of g would move x by B_i / |N_i B_i| times that until w_i is zero again, or by T B_i / M_ii where
// M_ii sees to that. Pairs that neither holds count by others alone. Cost: products with |B| and |N|.
void AddEffectOfSlacks(const Problem& problem, const Solution& solution, TrajectoryErrors& errors);

// The largest difference of a row, relative to its largest value in `fine`. NaN where a number is not finite.
double RelativeDifference(const Matrix& coarse, const Matrix& fine);

// The memory of each x_i, per mass: 1/|A_ii|, but no longer than `longest`/|E_ii|.
Vector MemoryOf(const Problem& problem, double longest);

// Keeps only the columns of `solution` at the times `wanted`, which are increasing and among its times.
void KeepTimes(const std::vector<double>& wanted, Solution& solution);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_COMPONENT_ERRORS_H_
