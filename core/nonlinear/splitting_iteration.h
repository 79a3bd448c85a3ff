// SPDX-License-Identifier: Apache-2.0
// The iteration (5.2) of [Wu & Chen] for nonlinear problems, window by window.

#ifndef DLCS_CORE_NONLINEAR_SPLITTING_ITERATION_H_
#define DLCS_CORE_NONLINEAR_SPLITTING_ITERATION_H_

#include <vector>

#include "core/discretization/scheme.h"
#include "core/discretization/segment.h"
#include "core/nonlinear/functions.h"
#include "core/nonlinear/nonlinear_context.h"
#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// Solves the problem of `context` as core/nonlinear/solve_nonlinear.h describes, and records segments, certificate and
// costs. Returns whether T was reached; otherwise context.Fail() has been called. Sets solution.reason to the choice of
// W.
bool SplittingIteration(NonlinearContext& context);

// Raises `certificate` (all NaN before the first segment) by the nodes and midpoints of `segment`, with f and g
// evaluated anew at x and y. segment.f holds the sources s = f - W x that the states follow by `scheme`; `times` the
// node times. Returns g(t, x, y) at the nodes, a column for each. At midpoints x solves x' = W x + s with s linear over
// the step, and y is linear. Not for the inner loop.
Matrix AddToCertificate(NonlinearFunctions& functions, const Scheme& scheme, const Matrix& W, const Segment& segment,
                        const std::vector<double>& times, Certificate& certificate);

// The derivative of x ↦ f(t, x, y(x)) with y(x) the solution of 0 <= y ⟂ g(t, x, y) >= 0 near `y`:
//
//     f_x - f_yS (g_y)_SS⁻¹ g_xS,   S = { i : y_i > 0, y_i >= g_i },
//
// With this W, f - W x minus its value at the start is of second order in x - x_a, and the iteration contracts in
// proportion to the distance from x_a. f_x alone where (g_y)_SS is singular. Not finite where a formula has no
// derivative.
// Cost: the Jacobians and O(m² n).
Matrix ReducedJacobian(NonlinearFunctions& functions, double t, const Vector& x, const Vector& y);

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_SPLITTING_ITERATION_H_
