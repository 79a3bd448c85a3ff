// SPDX-License-Identifier: Apache-2.0
// Sources between nodes: piecewise linear, or cubic splines from break point to break point.

#ifndef DLCS_CORE_ITERATION_INTERPOLATION_H_
#define DLCS_CORE_ITERATION_INTERPOLATION_H_

#include <vector>

#include "core/discretization/grid.h"
#include "core/problem/options.h"

namespace dlcs {

// A function on one run: on step l, s(t_l + θh) = Σ_k coefficients[k].col(l) θ^k for θ in [0, 1].
struct InterpolatedRun {
  std::vector<Matrix> coefficients;  // each m × steps; as many as the degree and one
};

// The interpolant of `values`, whose columns are those of NodeColumns(grid), run by run.
//
// Linear: degree 1. Cubic: the spline with continuous second derivatives through all nodes between two break points,
// with not-a-knot ends, of fourth order; for two steps a parabola, for one step a straight line. Steps may be unequal.
// Cost: one sparse factorization of a smooth interval, and a few m × nodes.
// Source: [Wu & Chen], section 2.3 (linear) and Remark 2.5; de Boor, A practical guide to splines, chapter IV.
std::vector<InterpolatedRun> Interpolate(Interpolation kind, const Grid& grid, const Matrix& values);

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_INTERPOLATION_H_
