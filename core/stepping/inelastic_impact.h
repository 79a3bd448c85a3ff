// SPDX-License-Identifier: Apache-2.0
// Systems of relative degree two, as mechanics with inelastic impacts.

#ifndef DLCS_CORE_STEPPING_INELASTIC_IMPACT_H_
#define DLCS_CORE_STEPPING_INELASTIC_IMPACT_H_

#include "core/context/solve_context.h"

namespace dlcs {

// For M = 0 and N B = 0 with no row of N A B zero, y acts on the gap w = N x + g through its velocity
// v = w' = N A x + N f + g' alone. On each step, with C the constraints in contact (closed, not separating):
//
//     x_j = E x_{j-1} + h φ_1 B y_j + (terms of f),    y_C from  0 <= y_C ⟂ v_C(t_j) >= 0,   y = 0 elsewhere,
//
// and where a gap has closed with v_i < 0, the state jumps by B p at t_j, with K the contacts and the closed gaps:
//
//     0 <= p_K ⟂ v_K + (N A B)_KK p_K >= 0.
//
// A gap that has been overshot since its impact is opened again by the least move along A B. This is Moreau's sweeping
// process with restitution zero, stepped in velocities: first order, and an impact is found at the node behind it. Its
// jumps are those of the solution. y is the contact force between impacts, constant on each step. g' is taken from the
// differences of g. Ends with kInfeasible where no impulse can stop a closing gap, or a gap is negative at 0 or behind
// a jump of g; with kUnsupported where a row of N A B is zero.
// Returns whether the end was reached. One thread. Cost: as a march, and one LCP of the contacts a step.
// Source: [Moreau 1988] J. J. Moreau. Unilateral contact and dry friction in finite freedom dynamics. CISM 302, 1-82.
bool InelasticImpact(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_INELASTIC_IMPACT_H_
