// SPDX-License-Identifier: Apache-2.0
// One LCP by one solver, for tests of the solvers themselves.

#ifndef DLCS_TESTS_SUPPORT_LCP_OUTCOME_H_
#define DLCS_TESTS_SUPPORT_LCP_OUTCOME_H_

#include <string>

#include "core/lcp/dense/complementary_solver.h"
#include "core/types.h"

namespace dlcs::testing {

struct LcpOutcome {
  LcpStatus verdict;
  Vector y;
  std::string method;
};

// Solves LCP(q, M) of `solver` from the empty basis, with no tolerance but rounding.
inline LcpOutcome SolveCold(LcpSolver& solver, const Vector& q) {
  Basis basis(q.size(), 0);
  Vector y = Vector::Zero(q.size());
  const LcpStatus verdict = solver.Solve(q, Vector::Zero(q.size()), basis, y);
  return {verdict, y, solver.Account().method};
}

// The size of the numbers that q + M y is summed from.
inline double SizeOfSums(const Matrix& M, const Vector& q, const Vector& y) {
  return 1 + q.norm() + M.norm() * y.norm();
}

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_LCP_OUTCOME_H_
