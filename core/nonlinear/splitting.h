// SPDX-License-Identifier: Apache-2.0
// The matrix W of the splitting (5.2) of [Wu & Chen], x' = W x + (f(t, x, y) - W x).

#ifndef DLCS_CORE_NONLINEAR_SPLITTING_H_
#define DLCS_CORE_NONLINEAR_SPLITTING_H_

#include "core/nonlinear/functions.h"
#include "core/types.h"

namespace dlcs {

// The derivative of x ↦ f(t, x, y(x)) with y(x) the solution of 0 <= y ⟂ g(t, x, y) >= 0 near `y`:
//
//     f_x - f_yS (g_y)_SS⁻¹ g_xS,   S = { i : y_i > 0, y_i >= g_i },
//
// what is left of f - W x is then of second order in x - x_a, and the iteration contracts in proportion to the distance
// from x_a. f_x alone where (g_y)_SS is singular. Not finite where a formula has no derivative.
// Cost: the Jacobians and O(m² n).
Matrix ReducedJacobian(NonlinearFunctions& functions, double t, const Vector& x, const Vector& y);

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_SPLITTING_H_
