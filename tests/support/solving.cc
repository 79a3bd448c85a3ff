// SPDX-License-Identifier: Apache-2.0
#include "tests/support/solving.h"

#include <gtest/gtest.h>

#include <utility>

#include "core/solve.h"

namespace dlcs::testing {

Solution SolveWith(const Problem& problem, const Options& options) {
  Observer silent;
  auto solution = Solve(problem, options, silent, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return solution.ok() ? *std::move(solution) : Solution{};
}

Solution SolveToEnd(const Problem& problem, const Options& options) {
  Solution solution = SolveWith(problem, options);
  EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  return solution;
}

Solution SolveForEnd(const Problem& problem) {
  Options options;
  options.output_times = {problem.horizon};
  options.output_times_only = true;
  return SolveToEnd(problem, options);
}

}  // namespace dlcs::testing
