// SPDX-License-Identifier: Apache-2.0
// How far two trajectories of one problem are apart, component by component.

#ifndef DLCS_CORE_CONTEXT_COMPONENT_ERRORS_H_
#define DLCS_CORE_CONTEXT_COMPONENT_ERRORS_H_

#include <vector>

#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// Errors of each state, and of each component of B y and w where those are measured, relative to the size of the
// component.
struct ComponentErrors {
  Vector x = {};
  Vector By = {};
  Vector w = {};

  double largest() const;  // NaN if one of them is
  // Raises each entry to `factor` times that of `other`, where that is larger; NaN if either is.
  void RaiseTo(const ComponentErrors& other, double factor = 1);
  void operator+=(const ComponentErrors& other);
  void operator*=(double factor);
  // Moves them to `accuracy`, whose error becomes the largest of them.
  void MoveTo(Accuracy& accuracy);
};

// The sizes that errors are relative to: the largest value of each component on [0, T], and the rounding error of the
// terms that it is the sum of. Differences within the rounding of a component that is no larger count as 0. w_i may be
// a small difference of large terms, so its size is the largest sum of the absolute values of its terms.
struct ComponentSizes {
  Vector x, x_rounding;
  Vector By, By_rounding;  // empty if B y is not measured
  Vector w;                // likewise
};

// The sizes of the components of `solution`. The rounding of x_i is that of the terms of x_i' over the time that x_i
// remembers them: T, or 1/|A_ii|. B y and w are measured only with `y_counts`, which is set if y is a Lipschitz
// function of x. Otherwise w is either N x + g, whose error is that of x, or as undetermined as y.
ComponentSizes SizesOf(const Problem& problem, const Solution& solution, bool y_counts);
// The same for a nonlinear problem: x alone, each component relative to its largest value.
ComponentSizes SizesOf(const Solution& solution);

// The largest differences at the times that both solutions have. Times within `apart` of an inner jump of either one
// are left out, since the two may be on different sides of it. Memory: a few columns.
ComponentErrors DifferencesBetween(const Solution& a, const Solution& b, const Problem& problem,
                                   const ComponentSizes& sizes, double apart = 0);
ComponentErrors DifferencesBetween(const Solution& a, const Solution& b, const ComponentSizes& sizes);

// For the steps in which a pair switches, and for those after them, in which y settles: the largest change of (B y)_i
// from node to node times the length of the step, or times the memory of x_i where that is shorter. Relative to the
// sizes of x. Cost: a product with B for each such step.
ComponentErrors SwitchChanges(const Solution& solution, const Problem& problem, const ComponentSizes& sizes);

// Each difference relative to its size. If the size is no more than rounding: 0 if the difference is no more either,
// else 1, since the component may be as large as the difference.
Vector Relative(const Vector& difference, const Vector& size, const Vector& rounding);

// The largest difference of a row, relative to its largest value in `fine`. NaN where a number is not finite.
double RelativeDifference(const Matrix& coarse, const Matrix& fine);

// The memory of each x_i, per mass: 1/|A_ii|, but no longer than `longest`/|E_ii|.
Vector MemoryOf(const Problem& problem, double longest);

// Keeps only the columns of `solution` at the times `wanted`, which are increasing and among its times.
void KeepTimes(const std::vector<double>& wanted, Solution& solution);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_COMPONENT_ERRORS_H_
