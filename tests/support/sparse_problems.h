// SPDX-License-Identifier: Apache-2.0
// Large systems with sparse matrices, in any size.

#ifndef DLCS_TESTS_SUPPORT_SPARSE_PROBLEMS_H_
#define DLCS_TESTS_SUPPORT_SPARSE_PROBLEMS_H_

#include "core/problem/problem.h"

namespace dlcs::testing {

struct GridShape {
  Index side = 10;  // inner points in each direction of the unit square, or cube
  int dimensions = 2;
  Index constraints = 5;
  double speed = 0;  // of the flow along the diagonal
  double diffusion = 0.05;
};

// Heat carried over a square or a cube by diffusion and a flow, central differences, zero at the boundary. A heater at
// each of `constraints` points keeps the mean of a small patch from falling below a level that rises and falls: y is
// its power, w = N x + g + M y, M tridiagonal (-1, 4, -1) and so a P-matrix. Constant cooling, f = lift · 1, a warm
// start. All matrices are sparse; T = 1.
Problem AdvectedGrid(const GridShape& shape);

// The same numbers in dense matrices.
Problem WithDenseMatrices(const Problem& problem);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_SPARSE_PROBLEMS_H_
