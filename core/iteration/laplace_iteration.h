// SPDX-License-Identifier: Apache-2.0
// The iteration of Wu & Chen in reduced space, window by window.

#ifndef DLCS_CORE_ITERATION_LAPLACE_ITERATION_H_
#define DLCS_CORE_ITERATION_LAPLACE_ITERATION_H_

#include "core/context/solve_context.h"

namespace dlcs {

// Solves the problem of `context` by iterating, on windows of W steps with start x_a, y_a,
//
//     y_j^k = SOL(q_j^{k-1}, M)                      all j at once, in parallel,
//     q_j^k = q_j^0 + Σ_{l=1..j} K_{j-l} (y_l^k - y_a)      one convolution in time (core/laplace/kernel.h),
//                                                           or N x_j^k + g_j where steps have several lengths,
//
// where q^0 = N x^0 + g comes from the ODE solved with y frozen at y_a (if its LCPs have no solution, the iteration
// starts from the constant x_a instead, as in Theorem 3.2). This is the iteration (3.3) of
// [Wu & Chen] with the hats of the interpolant integrated exactly: it needs N x only, so an iteration is
// independent of the number of states, and A may have any spectrum.
//
// A window ends at a break point. If runs of equal steps are short, a window may contain steps of several lengths (up
// to kCachedSteps); then the states are computed in every iteration, O(m²) per step.
//
// Windows start with L κ W h near 1, are halved when the iteration diverges or leaves the feasible set, and grow again
// on success; a single step that still fails is solved by the coupled LCP with the matrix M + K_0. With a fixed width
// or the whole horizon in the options, the failure ends the solve instead (kDiverged; kIterationLimit, with the last
// iterate as trajectory of the window).
// Requires a Lipschitz y (P-matrix, or Z-matrix with the least element). Returns whether the end was reached.
// Threads: those of context.workers; same bits for any number.
bool LaplaceIteration(SolveContext& context);

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_LAPLACE_ITERATION_H_
