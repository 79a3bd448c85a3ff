// SPDX-License-Identifier: Apache-2.0
// One step of a linear scheme, and its interpolant at the midpoint of the step.

#ifndef DLCS_CORE_DISCRETIZATION_SCHEME_H_
#define DLCS_CORE_DISCRETIZATION_SCHEME_H_

#include "core/discretization/segment.h"
#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// Every method with fixed steps advances the state by
//
//     x_j = state x_{j-1} + y_before y_{j-1} + y_after y_j + f_before f_{j-1} + f_after f_j,
//
// and differs only in the matrices. An empty matrix stands for zero. Substituting it into
// 0 <= y_j ⟂ N x_j + g_j + M y_j >= 0 gives the coupled step LCP(q, M + K_0) with K_0 = N y_after.
struct Scheme {
  double step = 0;
  Matrix state;
  Matrix y_before, y_after;
  Matrix f_before, f_after;

  // y between nodes: linear, or constant and equal to y_j on (t_{j-1}, t_j].
  bool y_is_linear = false;
  // x between nodes: linear; or the solution of the differential equation with the interpolated sources,
  //     x_mid = mid_state x_{j-1} + mid_y_before y_{j-1} + mid_y_after y_j + mid_f_before f_{j-1} + mid_f_after f_j.
  bool x_is_linear = false;
  Matrix mid_state;
  Matrix mid_y_before, mid_y_after;
  Matrix mid_f_before, mid_f_after;

  // Order of convergence of x at the nodes, with y as smooth as the method asks for.
  int order = 1;
};

// exp-PL: the differential equation solved exactly with y and f piecewise linear. With E = e^{hA} and φ_k at hA,
//     x_j = E x_{j-1} + h(φ_1 - φ_2) s_{j-1} + h φ_2 s_j,   s = B y + f.
// Second order where y is Lipschitz (M a P-matrix, or a Z-matrix with the least element). It must not be used
// otherwise: for M = 0, y_j = -y_{j-1} + ..., which oscillates without end.
// Errors: none; an overflow of e^{hA} gives non-finite matrices. Cost: ComputePhiFunctions() and 8 m²n.
Scheme ExponentialPiecewiseLinear(const Problem& problem, double step);

// exp-PC: the same with y constant on each step:
//     x_j = E x_{j-1} + h φ_1 B y_j + h(φ_1 - φ_2) f_{j-1} + h φ_2 f_j.
// First order. It needs no smoothness of y, so it can be used for M = 0, singular and skew M, sliding modes and
// inconsistent starts.
Scheme ExponentialPiecewiseConstant(const Problem& problem, double step);

// The θ-scheme (1.3) of [Chen & Xiang 2013] by substitution, with θ = 0 implicit and θ = 1 explicit in x (many texts
// use 1 - θ), R = (I - h(1-θ)A)⁻¹:
//     x_j = R (I + hθA) x_{j-1} + h R B y_j + h R f_j.
// A singular I - h(1-θ)A gives non-finite matrices. Cost: one LU of m × m.
Scheme ThetaScheme(const Problem& problem, double step, double theta);

// The trapezoidal rule in x and in s = B y + f, R = (I - hA/2)⁻¹:
//     x_j = R (I + hA/2) x_{j-1} + h R (s_{j-1} + s_j)/2.
// Second order where y is Lipschitz; like ExponentialPiecewiseLinear() it must not be used otherwise. A singular I -
// hA/2 gives non-finite matrices. Cost: one LU of m × m.
Scheme AveragedScheme(const Problem& problem, double step);

// Fills the columns 1.. of x of `segment` from its first column, y and f, by the recursion of an exp-PL `scheme`. All
// four hold segment.steps + 1 columns.
void Propagate(const Scheme& scheme, Segment& segment);

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_SCHEME_H_
