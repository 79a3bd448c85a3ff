// SPDX-License-Identifier: Apache-2.0
// Solve() for tests that want the solution and nothing else.

#ifndef DLCS_TESTS_SUPPORT_SOLVING_H_
#define DLCS_TESTS_SUPPORT_SOLVING_H_

#include <set>
#include <vector>

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

// By event location to an error, or to that which is taken where none is asked for, with dense output. A start that
// violates its constraints is moved onto them. The solution may end early.
Solution SolveAt(const Problem& problem, double tolerance, std::vector<double> times = {});
inline constexpr double kNoTolerance = 0;

Vector LastState(const Solution& solution);

// The largest estimated error of components, relative to their sizes.
double FigureOf(const ErrorsByCause& errors);

// Where the active set changes, the start left out.
std::vector<double> SwitchesOf(const Solution& solution);

// The active set at the end, as the list of switching times tells it.
std::set<Index> LastActive(const Solution& solution);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_SOLVING_H_
