// SPDX-License-Identifier: Apache-2.0
// The state at a time where it need not be consistent: at 0 and after a break point.

#ifndef DLCS_CORE_CONTEXT_CONSISTENCY_H_
#define DLCS_CORE_CONTEXT_CONSISTENCY_H_

#include "core/context/solve_context.h"
#include "core/types.h"

namespace dlcs {

// Prepares the state `x` and the multiplier `y` at `time`, the start of a smooth interval, for g(time⁺) = `g`.
//
// Where the rule gives a solution of LCP(N x + g, M): that is y, and x stays. Where M is positive semidefinite (M = 0
// included): x is consistent when LCP(N x + g, M) has a solution. Otherwise it must jump to x + B p, with p from the
// LCP
//
//     0 <= p ⟂ N(x + B p) + g + M μ >= 0,     0 <= μ ⟂ -Mᵀp >= 0,
//
// the limit of the first implicit Euler step; that is refused (kInconsistentState, naming the jump) unless the options
// ask to project, and then applied and noted in the solution. When no jump helps: kInfeasible. For other M nothing is
// decided here; the first coupled step decides.
//
// A row of N x + g that is negative by less than kLcpTolerance times its size (a little more after steps) counts as
// zero, and a jump that moves all rows by less is not applied. The size of a row is context.starts.row_size: the
// largest value so far of |N||x| + |g| + |M||y| at the starts of smooth intervals, with `y` from the interval before,
// and of |g| at samples of [0, T].
//
// Returns false if the solve has ended. Sets `y_is_solution` to whether y was found; if not, y is zero.
// Source: the jump rule of linear passive complementarity systems, [Camlibel, Heemels, Schumacher 2002]
// K. Camlibel, W. Heemels, J. Schumacher. On linear passive complementarity systems. Eur. J. Control 8, 220-237.
bool StartInterval(SolveContext& context, double time, const Eigen::Ref<const Vector>& g, Eigen::Ref<Vector> x,
                   Eigen::Ref<Vector> y, bool& y_is_solution);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_CONSISTENCY_H_
