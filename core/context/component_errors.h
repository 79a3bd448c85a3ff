// SPDX-License-Identifier: Apache-2.0
// How far two trajectories of one problem are apart, component by component.

#ifndef DLCS_CORE_CONTEXT_COMPONENT_ERRORS_H_
#define DLCS_CORE_CONTEXT_COMPONENT_ERRORS_H_

#include <vector>

#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// Of each state, and of each component of B y and of w where those count; relative to the size of the component.
struct ComponentErrors {
  Vector x = {};
  Vector By = {};
  Vector w = {};

  double largest() const;  // NaN where one is
  // The larger of two, entry by entry; NaN where one is.
  void RaiseTo(const ComponentErrors& other, double factor = 1);
  void operator+=(const ComponentErrors& other);
  void operator*=(double factor);
  // Makes them those of `accuracy`, whose error is the largest.
  void MoveTo(Accuracy& accuracy);
};

// What the components are measured by: their largest values on [0, T], and what rounding may make of the numbers they
// are summed from. A component that is no more than its rounding has no accuracy, and its differences count as none.
// w_i is a difference of what may be large: its size is the largest sum of the absolute values that it is summed from.
struct ComponentSizes {
  Vector x, x_rounding;
  Vector By, By_rounding;  // empty where B y does not count
  Vector w;                // likewise
};

// As far as `solution` shows them. x_i is summed from what moves it, over as long as it remembers: T, or 1/|A_ii|.
// B y and w count with `y_counts`, where y is a Lipschitz function of x. Elsewhere w is either N x + g, whose error is
// that of x, or no more determined than y.
ComponentSizes SizesOf(const Problem& problem, const Solution& solution, bool y_counts);
// Of a problem that is not linear: x alone, each against itself.
ComponentSizes SizesOf(const Solution& solution);

// The largest differences at the times that both have, but for those within `apart` of a jump of either at an inner
// time where x must be expected to be on different sides of it. Memory: of a few columns.
ComponentErrors DifferencesBetween(const Solution& a, const Solution& b, const Problem& problem,
                                   const ComponentSizes& sizes, double apart = 0);
ComponentErrors DifferencesBetween(const Solution& a, const Solution& b, const ComponentSizes& sizes);

// Each difference relative to its size; 0 where that is no more than rounding.
Vector Relative(const Vector& difference, const Vector& size, const Vector& rounding);

// The largest difference of a row, relative to its largest value in `fine`. NaN where a number is not finite.
double RelativeDifference(const Matrix& coarse, const Matrix& fine);

// Leaves only the columns of `solution` that stand at `wanted`, some of its times, increasing.
void KeepTimes(const std::vector<double>& wanted, Solution& solution);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_COMPONENT_ERRORS_H_
