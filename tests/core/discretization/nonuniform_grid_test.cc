// SPDX-License-Identifier: Apache-2.0
// Grids of given nodes: the answers of uniform grids, in every method.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/discretization/grid.h"
#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::Case;
using testing::CaseError;
using testing::ErrorOf;
using testing::LoadCase;
using testing::ReferenceTimes;

struct Subject {
  const char* name;
  Method method;
  Index steps;
};

class NonuniformGridTest : public ::testing::TestWithParam<Subject> {
 protected:
  Solution Solved(const Options& options) {
    Options full = options;
    full.method = GetParam().method;
    full.output_times = ReferenceTimes(the_case_);
    full.output_times_only = true;
    full.project_initial_state = true;
    return testing::SolveToEnd(the_case_.problem, full);
  }
  CaseError Error(const Solution& solution) { return ErrorOf(the_case_, solution.times, solution.x, solution.y); }

  const Case the_case_ = LoadCase(GetParam().name);
};

TEST_P(NonuniformGridTest, UniformTimesGiveTheUniformAnswer) {
  Options uniform;
  uniform.num_steps = GetParam().steps;
  uniform.output_times = ReferenceTimes(the_case_);
  const Grid grid = MakeGrid(the_case_.problem.horizon, BreakPoints(the_case_.problem), uniform);
  Options given;
  given.grid_times = grid.times;
  const Solution a = Solved(uniform), b = Solved(given);
  EXPECT_EQ(a.cost.steps, b.cost.steps);
  EXPECT_EQ(a.times, b.times);
  EXPECT_LT(MaxAbs(a.x - b.x), 1e-10 * MaxAbs(a.x));
}

// Steps whose lengths all differ, by a factor of three between the shortest and the longest: no longest step is longer
// than those of the uniform grid, so no error should be much larger.
TEST_P(NonuniformGridTest, UnequalStepsAreAsAccurate) {
  const double horizon = the_case_.problem.horizon;
  const Index steps = GetParam().steps;
  Options uniform;
  uniform.num_steps = steps;
  Options given;
  const double longest = horizon / static_cast<double>(steps);
  for (double t = 0; t < horizon;) {
    given.grid_times.push_back(t);
    const double k = static_cast<double>(given.grid_times.size());
    t += longest * (2 + std::sin(12.9898 * k)) / 3;
  }
  const Solution equal = Solved(uniform), unequal = Solved(given);
  EXPECT_GT(unequal.cost.steps, steps);
  const CaseError expected = Error(equal), found = Error(unequal);
  EXPECT_LT(found.x, 2 * expected.x + 1e-9);
  EXPECT_LT(found.By, 2 * expected.By + 1e-9);
  EXPECT_LT(unequal.certificate.node_residual, 1e-9 * unequal.certificate.lcp_scale);
}

INSTANTIATE_TEST_SUITE_P(Methods, NonuniformGridTest,
                         ::testing::Values(Subject{"z_least", Method::kLaplaceIteration, 200},
                                           Subject{"z_least", Method::kExponentialIntegrator, 200},
                                           Subject{"z_least", Method::kTimeStepping, 200},
                                           Subject{"z_least", Method::kWuChenIteration, 100},
                                           Subject{"saturated_pd", Method::kLaplaceIteration, 300},
                                           Subject{"saturated_pd", Method::kExponentialIntegrator, 300},
                                           Subject{"rlcd", Method::kExponentialIntegrator, 2000},
                                           Subject{"rlcd", Method::kTimeStepping, 4000},
                                           Subject{"relay_sliding", Method::kExponentialIntegrator, 500},
                                           Subject{"diode_bridge_cap", Method::kTimeStepping, 2000}),
                         [](const auto& test) {
                           std::string name = std::string(test.param.name) + "_" + MethodName(test.param.method);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

// Half the steps are halved steps: the error estimate knows the grid.
TEST(NonuniformGridErrorTest, IsEstimatedOnHalvedSteps) {
  const Case the_case = LoadCase("z_least");
  Options options;
  options.method = Method::kExponentialIntegrator;
  options.estimate_error = true;
  options.output_times = ReferenceTimes(the_case);
  options.output_times_only = true;
  for (Index k = 0; k <= 60; ++k) {
    options.grid_times.push_back(the_case.problem.horizon * std::pow(static_cast<double>(k) / 60, 1.5));
  }
  Observer silent;
  const auto solution = Solve(the_case.problem, options, silent, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  const CaseError error = ErrorOf(the_case, solution->times, solution->x, solution->y);
  const double estimate = solution->accuracy.error;
  EXPECT_LT(error.x, 3 * estimate);
  EXPECT_GT(error.x, estimate / 30);
}

}  // namespace
}  // namespace dlcs
