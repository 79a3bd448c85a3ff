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
// A gap that has become negative since its impact is reset to zero by the smallest move along A B. This is Moreau's
// sweeping process with restitution zero, stepped in velocities: first order, and an impact is found at the first node
// after it. The jumps are reported in Solution::jumps. y is the contact force between impacts, constant on each step.
// g' is computed from differences of g. Ends with kInfeasible if no impulse can stop a closing gap, or if a gap is
// negative at 0 or after a jump of g; with kUnsupported if a row of N A B is zero.
// Returns whether the end was reached. One thread. Cost: that of exp-PC steps, and one LCP of the contacts per step.
// Source: [Moreau 1988] J. J. Moreau. Unilateral contact and dry friction in finite freedom dynamics. CISM 302, 1-82.
bool InelasticImpact(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_INELASTIC_IMPACT_H_
