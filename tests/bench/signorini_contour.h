// SPDX-License-Identifier: Apache-2.0
// The iteration of [Wu & Chen] on the Signorini problem as their paper has it, for the cost of an iteration.

#ifndef DLCS_TESTS_BENCH_SIGNORINI_CONTOUR_H_
#define DLCS_TESTS_BENCH_SIGNORINI_CONTOUR_H_

#include "core/problem/problem.h"
#include "core/propagator/factor_transform.h"

namespace dlcs::bench {

// The states x^{k+1} at single times, for the input u = y^k + ψ: (2.5) and (2.6) with P = 25, a contour of its own for
// every time and the linear systems solved by sine transforms, as in section 4.2. The states of J times cost O(J² P Q +
// J P Q²).
class PrintedIterate {
 public:
  // Column j of `input` is u at t_j = T j / (columns - 1).
  PrintedIterate(const Problem& problem, const Matrix& input);

  // x(t_j) on the grid, (x1, x2).
  Matrix State(Index j) const;
  // The same without a contour, from the exact integrals for each mode.
  Matrix ExactState(Index j) const;

 private:
  Matrix OnGrid(const Matrix& modes) const;
  double Time(Index j) const { return step_ * static_cast<double>(j); }

  Index size_;
  double step_, weight_;
  FactorTransform transform_;
  Vector along_;          // e_1 in modes
  Matrix input_, start_;  // in modes: (b, j), and (b, a) of the initial value
};

}  // namespace dlcs::bench

#endif  // DLCS_TESTS_BENCH_SIGNORINI_CONTOUR_H_
