// SPDX-License-Identifier: Apache-2.0
// The systems of the benchmarks of work and precision, with answers that are known.

#ifndef DLCS_TESTS_BENCH_KNOWN_SYSTEMS_H_
#define DLCS_TESTS_BENCH_KNOWN_SYSTEMS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs::bench {

struct KnownSystem {
  std::string name;
  Problem problem;
  std::vector<double> times;
  Matrix x;                // at these times
  double uncertainty = 0;  // of x, relative
  Index most_steps = 0;    // worth trying
  bool y_is_lipschitz = true;
  bool breaks_down = false;    // implicit Euler with long steps: its M^h has no solution
  bool has_few_states = true;  // for the ways that take A as a dense matrix
};

// Example 4.1 of [Chen & Xiang], the example with four variables of [Wu & Chen] with easy and with hard data, six of
// tests/cases, and the Signorini problem with Δx = 1/40. `quick`: references that cost less and are less certain.
std::vector<KnownSystem> KnownSystems(bool quick);

// Of x at the system's times: each component relative to its largest value.
double TrueError(const KnownSystem& system, const Solution& solution);

// The system's times as output, on one thread.
Options OptionsFor(const KnownSystem& system);
// ... by a method of fixed steps; `averaged`: the trapezoidal rule of time_stepping.
Options OptionsFor(const KnownSystem& system, Method method, bool averaged, Index steps);

// By event location, with an error in place of steps.
absl::StatusOr<Solution> SolveByEvents(const KnownSystem& system, double tolerance);

}  // namespace dlcs::bench

#endif  // DLCS_TESTS_BENCH_KNOWN_SYSTEMS_H_
