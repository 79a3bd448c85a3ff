// SPDX-License-Identifier: Apache-2.0
#include "tests/support/semidefinite_problems.h"

namespace dlcs::testing {

SemidefiniteProblem DrawSemidefinite(LcpGenerator& generator, int round, Index max_size) {
  const Index n = generator.Integer(2, max_size);
  SemidefiniteProblem problem;
  switch (round % 4) {
    case 0:
      problem.M = generator.Skew(n);
      break;
    case 1: {  // nonnegative factors: the solution set is a polytope of dimension n - rank
      const Matrix G = generator.Gaussian(n, generator.Integer(1, n - 1)).cwiseAbs();
      problem.M = G * G.transpose();
      break;
    }
    case 2:
      problem.M = generator.PositiveSemidefinite(n, generator.Integer(0, n - 1));
      break;
    default:
      problem.M = generator.PositiveSemidefinite(n, n - 1);
      problem.M.row(1) = problem.M.row(0);
      problem.M.col(1) = problem.M.col(0);
      break;
  }
  problem.q = generator.SolvableQ(problem.M, round % 3 == 0, &problem.known);
  if (round % 4 == 3) {  // the same slack for both, zero if one of them is active
    const Vector& y = problem.known;
    const double w = y[0] > 0 || y[1] > 0 ? 0 : (problem.q + problem.M * y)[0];
    problem.q[0] = problem.q[1] = w - problem.M.row(0) * y;
  }
  return problem;
}

}  // namespace dlcs::testing
