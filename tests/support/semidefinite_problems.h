// SPDX-License-Identifier: Apache-2.0
// Linear complementarity problems with a convex set of solutions that often is more than a point.

#ifndef DLCS_TESTS_SUPPORT_SEMIDEFINITE_PROBLEMS_H_
#define DLCS_TESTS_SUPPORT_SEMIDEFINITE_PROBLEMS_H_

#include "core/types.h"
#include "tests/support/lcp_problems.h"

namespace dlcs::testing {

struct SemidefiniteProblem {
  Matrix M;  // positive semidefinite
  Vector q;
  Vector known;  // a solution
};

// By `round` mod 4, with n in [2, max_size]: skew; symmetric of low rank; neither, of low rank; with one constraint
// twice. q has a solution with entries that are degenerate in every third round.
SemidefiniteProblem DrawSemidefinite(LcpGenerator& generator, int round, Index max_size = 7);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_SEMIDEFINITE_PROBLEMS_H_
