// SPDX-License-Identifier: Apache-2.0
// One step with x and y determined together, where the splitting does not contract on it.

#ifndef DLCS_CORE_NONLINEAR_NONLINEAR_STEP_H_
#define DLCS_CORE_NONLINEAR_NONLINEAR_STEP_H_

#include "core/nonlinear/functions.h"
#include "core/nonlinear/josephy_newton.h"
#include "core/types.h"

namespace dlcs {

// Solves x = known + after (f(t, x, y) - W x), 0 <= y ⟂ g(t, x, y) >= 0: the fixed point of the splitting on one step,
// with `known` the terms from the start of the step and `after` the weight of the source at its end (scheme.f_after). x
// is eliminated by Newton's method, and y(x) is a nonlinear complementarity problem with Jacobian g_y + g_x (I - after
// (f_x - W))⁻¹ after f_y. `x` and `y` hold guesses and take the solution. Finds any solution of the coupled step; the
// caller has to check whether y is the selected solution of 0 <= y ⟂ g(t, x, ·) >= 0. Errors: the verdicts of
// JosephyNewton; kStalled where Newton's method found no x for the y that it ended with.
// Cost: a few LU of m × m per LCP.
ComplementarityResult SolveCoupledStep(NonlinearFunctions& functions, double t, const Vector& known,
                                       const Matrix& after, const Matrix& W, Vector& x, Vector& y);

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_NONLINEAR_STEP_H_
