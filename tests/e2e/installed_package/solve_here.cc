// SPDX-License-Identifier: Apache-2.0
// x' = y - 1, 0 <= y ⟂ x + y >= 0, x(0) = 1, in this process.
#include <cstdio>

#include "core/solve.h"

int main() {
  const dlcs::Matrix zero = dlcs::Matrix::Zero(1, 1), one = dlcs::Matrix::Ones(1, 1);
  const auto f = dlcs::TimeFunction::Constant(dlcs::Vector::Constant(1, -1));
  const dlcs::Problem problem{zero, one, one, one, f, dlcs::TimeFunction::Zero(1), dlcs::Vector::Ones(1), 2};
  dlcs::Observer observer;
  const auto solution = dlcs::Solve(problem, {}, observer, {});
  if (!solution.ok() || solution->termination != dlcs::Termination::kReachedEnd) return 1;
  std::printf("%.17g\n", solution->x(0, solution->x.cols() - 1));
}
