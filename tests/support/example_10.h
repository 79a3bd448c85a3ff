// SPDX-License-Identifier: Apache-2.0
// Example 10 of [Shen & Pang 2007]: a system of index one with a P-matrix CB and many solutions.

#ifndef DLCS_TESTS_SUPPORT_EXAMPLE_10_H_
#define DLCS_TESTS_SUPPORT_EXAMPLE_10_H_

#include "core/lcp/dynamic_lcp.h"

namespace dlcs {

// DCP(-1 t, R) on [0, horizon] with R = [1 3 0; 0 1 3; 3 0 1], a nonnegative P-matrix: what the system of the
// example is for x0 = (0, 0, 0, 1). q(0) = 0, but q decreases: x0 lies outside the semiobservability cone.
DcpProblem ExampleTenDcp(double horizon);

// The solution that time stepping finds: u = v' = (1, 1, 1)/4.
PiecewiseLinearPath ExampleTenEvenSolution(double horizon);

// Another one for each `a` in [1, 8): on [a 2^k, a 2^{k+1}) only component k mod 3 (counted from 0) of u is
// positive, with rate 1.
//
// It solves the DCP: let s = a 2^k and component i be active on [s, 2s). Its earlier phases are s/8, s/64,
// ... long, s/7 in all; so v_i(s) = s/7, and 4s/7 and 2s/7 for the components active before and before that,
// in sum s. For i = 0, w_0 = v_0 + 3v_1 - t = s/7 + (t - s) + 6s/7 - t = 0, w_1 = v_1 + 3v_2 - t = 2s - t >=
// 0, and w_2 = 3v_0 + v_2 - t = 2(t - s) >= 0; the others follow since R commutes with cyclic shifts.
//
// The phases accumulate at t = 0. The path is linear before the first node a 2^k below 1e-9 `horizon`, which
// costs the complementarity integral at most the square of that time.
PiecewiseLinearPath ExampleTenSwitchingSolution(double a, double horizon);

}  // namespace dlcs

#endif  // DLCS_TESTS_SUPPORT_EXAMPLE_10_H_
