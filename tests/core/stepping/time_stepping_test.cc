// SPDX-License-Identifier: Apache-2.0

#include "core/stepping/time_stepping.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/discretization/scheme.h"
#include "core/linalg/norms.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

Solution Step(const Problem& problem, Index steps, double theta = 0) {
  Options options;
  options.method = Method::kTimeStepping;
  options.num_steps = steps;
  options.theta = theta;
  return testing::SolveWith(problem, options);
}

TEST(TimeSteppingTest, ReproducesTheCoupledMatricesPrintedForFourVariables) {
  // [Wu & Chen], after (4.2): M^h for h = 2⁻⁸, 2⁻⁷, 2⁻⁶.
  const double printed[3][4][4] = {{{0.6725, -0.9942, -0.3333, -1.6725},
                                    {-0.6598, 0.3480, -0.6511, -1.3246},
                                    {-0.6569, -0.0226, 0.0058, -1.6696},
                                    {-1.0253, -0.0263, -1.6803, 0.3421}},
                                   {{0.6782, -0.9884, -0.3334, -1.6783},
                                    {-0.6528, 0.3628, -0.6355, -1.3160},
                                    {-0.6472, -0.0119, 0.0117, -1.6725},
                                    {-1.0506, -0.0526, -1.6939, 0.3509}},
                                   {{0.6896, -0.9770, -0.3335, -1.6897},
                                    {-0.6385, 0.3925, -0.6045, -1.2993},
                                    {-0.6279, 0.0095, 0.0232, -1.6785},
                                    {-1.1007, -0.1050, -1.7207, 0.3686}}};
  const Problem problem = testing::FourVariableHard();
  for (int k = 0; k < 3; ++k) {
    const Scheme scheme = ThetaScheme(problem, std::ldexp(1.0, k - 8), 0);
    const Matrix coupled = problem.M.Dense() + problem.N * scheme.y_after;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) EXPECT_NEAR(coupled(i, j), printed[k][i][j], 5.1e-5) << k << i << j;
    }
  }
}

TEST(TimeSteppingTest, FindsNoSolutionOfTheHardDataWhereTheCoupledMatrixIsNoZMatrix) {
  for (const Index steps : {16, 32, 64}) {
    const Solution solution = Step(testing::FourVariableHard(), steps);
    EXPECT_EQ(solution.termination, Termination::kInfeasible) << steps << ": " << solution.message;
    EXPECT_DOUBLE_EQ(solution.failure_time, 0.4375) << steps;
    EXPECT_FALSE(solution.warnings.empty());
    EXPECT_DOUBLE_EQ(solution.times.back(), 0.4375 - 1.0 / static_cast<double>(steps)) << "trajectory so far";
  }
  for (const Index steps : {128, 256}) {
    const Solution solution = Step(testing::FourVariableHard(), steps);
    EXPECT_EQ(solution.termination, Termination::kReachedEnd) << steps << ": " << solution.message;
    EXPECT_TRUE(solution.warnings.empty());
  }
}

TEST(TimeSteppingTest, HasOrderOneForAnyTheta) {
  for (const double theta : {0.0, 0.5, 1.0}) {
    const auto error = [&](Index steps) {
      const Solution solution = Step(testing::ExampleFourOne(), steps, theta);
      EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
      return MaxAbs(solution.x.rightCols(1) - testing::ExampleFourOneExact(1));
    };
    EXPECT_NEAR(std::log2(error(1000) / error(2000)), 1, 0.1) << theta;
  }
}

TEST(TimeSteppingTest, EndsWithTheTimeWhenTheStateOverflows) {
  Problem problem = testing::Scalar(1000, 1, 1, 10);
  const Solution solution = Step(problem, 100000);
  EXPECT_EQ(solution.termination, Termination::kNonFinite) << solution.message;
  EXPECT_GT(solution.failure_time, 0.6);
  EXPECT_LT(solution.failure_time, 0.8);  // e^{1000 t} passes 1e308 at t = 0.71
  EXPECT_TRUE(solution.x.allFinite());
}

}  // namespace
}  // namespace dlcs
