// SPDX-License-Identifier: Apache-2.0
// Solve() for tests that want the solution and nothing else.

#ifndef DLCS_TESTS_SUPPORT_SOLVING_H_
#define DLCS_TESTS_SUPPORT_SOLVING_H_

#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs::testing {

// The test fails, and the solution is empty, if Solve() returns an error.
Solution SolveWith(const Problem& problem, const Options& options);

// The test fails also where the solution does not converge.
Solution SolveToEnd(const Problem& problem, const Options& options);

// The same with the default options, at T alone.
Solution SolveForEnd(const Problem& problem);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_SOLVING_H_
