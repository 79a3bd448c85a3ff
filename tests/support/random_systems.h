// SPDX-License-Identifier: Apache-2.0
// Random systems in even units, of every class that has one solution.

#ifndef DLCS_TESTS_SUPPORT_RANDOM_SYSTEMS_H_
#define DLCS_TESTS_SUPPORT_RANDOM_SYSTEMS_H_

#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "tests/support/lcp_problems.h"

namespace dlcs::testing {

// M positive definite, an indefinite P-matrix, an M-matrix, or skew, singular and zero; where it does not make y a
// function of x the system is passive (N = Bᵀ, A stable), so that x is unique. Up to 5 states and 4 pairs over T
// between 1 and 10; f and g are waves, every fourth with a kink that is not declared. It begins where no jump is
// needed.
Problem RandomSystem(LcpGenerator& random);

// The largest error over times and components of x, and of y and w where `y_counts`, relative to the largest value of
// the component in `exact`, which has the same times. Components that `solution` names as small are left out.
double TrueError(const Solution& solution, const Solution& exact, bool y_counts);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_RANDOM_SYSTEMS_H_
