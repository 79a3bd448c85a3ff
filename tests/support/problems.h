// SPDX-License-Identifier: Apache-2.0
// Small problems with known answers, most of them from the papers.

#ifndef DLCS_TESTS_SUPPORT_PROBLEMS_H_
#define DLCS_TESTS_SUPPORT_PROBLEMS_H_

#include <vector>

#include "core/problem/problem.h"

namespace dlcs::testing {

// Example 4.1 of [Chen & Xiang 2013] with the printed parameters and x(0) = (0, 1), T = 1: a Z-matrix that is no
// P-matrix. The least-element solution is
//     x1 = (4.8 sin 10t - 12 cos 10t)/116 + 3/29 e^{-4t},   x2 = e^{-2t},   y = (x1⁺, 0, 0, x1⁻);
// B has the sign of its first row that this solution belongs to.
Problem ExampleFourOne();
Vector ExampleFourOneExact(double t);

// The small example (4.2) of [Wu & Chen], M a Z-matrix and no P-matrix, with f = (√|1-cos t²|, 3 cos 3πt, √|1-cos 3t²|)
// and x0 = (0, -1/2, -1/2); the matrices reproduce the printed M^h. Its x0 and g are not legible in print.
// Hard: g = 2 + (-1, 1, 1, -1) t e^{-t/2}; x(1) ≈ (0.091747, -0.200648, 0.497778), no whole-window iteration converges.
Problem FourVariableHard();
// Easy: g = (3, 3/2, 2, 3/2) + t e^{-t/2} (1, 1, 1, 1); the whole-window iteration converges.
Problem FourVariableEasy();

// x' = a x + y, 0 <= y ⟂ x + g + y >= 0: for x + g <= 0, y = -(x + g).
Problem Scalar(double a, double g, double x0, double horizon);

// k relays: x' = A x + f - C sgn(D x), sgn(0) anything in [-1, 1]; y_i = 1 - sgn_i.
Problem Relays(const Matrix& A, const Matrix& C, const Matrix& D, const Vector& x0, double horizon);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_PROBLEMS_H_
