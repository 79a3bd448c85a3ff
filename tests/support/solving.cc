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

Solution SolveAt(const Problem& problem, double tolerance, std::vector<double> times) {
  Options options;
  options.method = Method::kEventDriven;
  options.error_tolerance = tolerance;
  options.output_times = std::move(times);
  options.output_times_only = !options.output_times.empty();
  options.keep_pieces = true;
  options.project_initial_state = true;
  return SolveWith(problem, options);
}

double FigureOf(const ErrorsByCause& errors) {
  double figure = 0;
  for (Index i = 0; i < errors.size(); ++i) {
    const double error = errors.truncation[i] + errors.rounding[i];
    if (!(error <= figure * errors.own[i])) figure = error / errors.own[i];
  }
  return figure;
}

Vector LastState(const Solution& solution) { return solution.x.col(solution.x.cols() - 1); }

std::vector<double> SwitchesOf(const Solution& solution) {
  std::vector<double> times;
  for (std::size_t k = 1; k < solution.switching_times.size(); ++k) times.push_back(solution.switching_times[k].time);
  return times;
}

std::set<Index> LastActive(const Solution& solution) {
  std::set<Index> active;
  for (const SwitchingTime& switching : solution.switching_times) {
    for (const Index i : switching.entering) EXPECT_TRUE(active.insert(i).second) << "entered twice: " << i;
    for (const Index i : switching.leaving) EXPECT_EQ(active.erase(i), 1u) << "left without having entered: " << i;
  }
  return active;
}

}  // namespace dlcs::testing
