// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/context/component_errors.h"
#include "core/discretization/scheme.h"
#include "core/linalg/norms.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::SolveWith;

Options Averaged(Index steps, StepSolver step_solver = StepSolver::kSubstitution) {
  Options options;
  options.method = Method::kTimeStepping;
  options.average_y = true;
  options.num_steps = steps;
  options.step_solver = step_solver;
  return options;
}

double ErrorOnExampleFourOne(const Solution& solution) {
  double error = 0;
  for (std::size_t k = 0; k < solution.times.size(); ++k) {
    const auto x = solution.x.col(static_cast<Index>(k));
    error = std::max(error, MaxAbs(x - testing::ExampleFourOneExact(solution.times[k])));
  }
  return error;
}

TEST(AveragedSchemeTest, HasOrderTwoOnExampleFourOne) {
  for (const StepSolver step_solver : {StepSolver::kSubstitution, StepSolver::kNewton}) {
    double last = 0;
    for (const Index steps : {100, 400, 1600}) {
      const Solution solution = SolveWith(testing::ExampleFourOne(), Averaged(steps, step_solver));
      ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
      const double error = ErrorOnExampleFourOne(solution);
      if (last > 0) {
        EXPECT_NEAR(std::log2(last / error) / 2, 2, 0.1) << steps;
      }
      last = error;
    }
    EXPECT_LT(last, 1e-5);
  }
}

TEST(AveragedSchemeTest, EstimatesItsErrorAsOneOfOrderTwo) {
  Options options = Averaged(200);
  options.estimate_error = true;
  const Solution solution = SolveWith(testing::ExampleFourOne(), options);
  Matrix exact(2, solution.x.cols());
  for (Index k = 0; k < exact.cols(); ++k) {
    exact.col(k) = testing::ExampleFourOneExact(solution.times[static_cast<std::size_t>(k)]);
  }
  const double relative = RelativeDifference(solution.x, exact);
  EXPECT_GT(solution.accuracy.error, relative / 3);
  EXPECT_LT(solution.accuracy.error, 30 * relative);
}

TEST(AveragedSchemeTest, HasOrderTwoOnCasesWithLipschitzMultipliers) {
  for (const char* name : {"saturated_pd", "wall_permeable", "z_least"}) {
    const testing::Case the_case = testing::LoadCase(name);
    const auto error = [&](Index steps) {
      Options options = Averaged(steps);
      options.output_times = testing::ReferenceTimes(the_case);
      options.output_times_only = true;
      const Solution solution = SolveWith(the_case.problem, options);
      EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
      return testing::ErrorOf(the_case, solution.times, solution.x, solution.y).x;
    };
    // A sixteenth of the step: order 2 is 1/256 of the error, order 1 a sixteenth.
    EXPECT_LT(error(16000), error(1000) / 100) << name;
  }
}

// M = 0: x' = -1 + y, 0 <= y ⟂ x >= 0 rests on x = 0 with y = 1.
TEST(AveragedSchemeTest, WouldRingAndIsRefusedWhereYIsNoFunctionOfX) {
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = problem.N = Matrix::Ones(1, 1);
  problem.M = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Constant(-Vector::Ones(1));
  problem.g = TimeFunction::Zero(1);
  problem.x0 = Vector::Zero(1);
  problem.horizon = 1;
  const Solution refused = SolveWith(problem, Averaged(10));
  EXPECT_EQ(refused.termination, Termination::kUnsupported);
  EXPECT_NE(refused.message.find("oscillates"), std::string::npos) << refused.message;

  // What it is refused for: at rest y_j = 2 - y_{j-1}, so that y = 0 at the start gives 2, 0, 2, 0, ... for ever.
  const Scheme scheme = AveragedScheme(problem, 0.1);
  double y = 0;
  for (int j = 0; j < 10; ++j) {
    const double explicit_part = scheme.y_before(0, 0) * y - (scheme.f_before(0, 0) + scheme.f_after(0, 0));
    y = std::max(0.0, -explicit_part / scheme.y_after(0, 0));
    EXPECT_NEAR(y, j % 2 == 0 ? 2 : 0, 1e-12);
  }
}

TEST(AveragedSchemeTest, ImpliesThetaOneHalf) {
  Options options = Averaged(10);
  EXPECT_TRUE(Validate(options, 1).empty());
  options.theta = 0.5;
  EXPECT_TRUE(Validate(options, 1).empty());
  options.theta = 0.25;
  const std::vector<Violation> violations = Validate(options, 1);
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].field, "average_y");
}

}  // namespace
}  // namespace dlcs
