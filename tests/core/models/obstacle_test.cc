// SPDX-License-Identifier: Apache-2.0
#include "core/models/obstacle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/linalg/norms.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using testing::SolveForEnd;

// The string that is at last straight beside its contact, from the tangents of the parabola through the ends.
double SteadyString(double s) {
  const double from_middle = std::abs(s - 0.5), contact = (1 - std::sqrt(0.5)) / 2;
  if (from_middle <= contact) return 0.5 - 4 * from_middle * from_middle;
  return 8 * contact * (0.5 - from_middle);
}

TEST(ObstacleTest, TheStringComesToRestOnTheObstacle) {
  const auto error = [](Index cells) {
    const auto problem = MakeObstacleProblem({.cells = cells, .horizon = 2});
    EXPECT_TRUE(problem.ok()) << problem.status();
    const Solution solution = SolveForEnd(*problem);
    double largest = 0;
    for (Index k = 0; k + 1 < cells; ++k) {
      const double s = static_cast<double>(k + 1) / static_cast<double>(cells);
      largest = std::max(largest, std::abs(solution.x(k, 0) - SteadyString(s)));
    }
    // In the contact y carries -c u'' = 8.
    EXPECT_NEAR(solution.y(cells / 2 - 1, 0), 8, 1e-6);
    EXPECT_EQ(solution.y(0, 0), 0);
    return largest;
  };
  EXPECT_LE(error(16), 1e-2);
  EXPECT_LE(error(64), 1e-3);
}

TEST(ObstacleTest, TheMembraneIsSymmetricAndAboveTheObstacle) {
  const auto problem = MakeObstacleProblem({.cells = 10, .dimensions = 2, .coefficient = 0.5, .load = "-2*t"});
  ASSERT_TRUE(problem.ok()) << problem.status();
  const Solution solution = SolveForEnd(*problem);
  const Eigen::Map<const Matrix> u(solution.x.data(), 9, 9);
  EXPECT_LE(MaxAbs(u - u.transpose()), 1e-6);
  EXPECT_LE(MaxAbs(u - u.rowwise().reverse()), 1e-6);
  EXPECT_GE(solution.w.minCoeff(), -1e-9);
  EXPECT_GT(solution.y.maxCoeff(), 0);
}

TEST(ObstacleTest, NamesEachBrokenRule) {
  const auto problem = MakeObstacleProblem({.cells = 1, .dimensions = 3, .coefficient = 0, .horizon = -1});
  EXPECT_THAT(problem.status().message(),
              ::testing::AllOf(HasSubstr("cells"), HasSubstr("dimensions: is 3, must be 1 or 2"),
                               HasSubstr("coefficient"), HasSubstr("horizon")));
  EXPECT_THAT(MakeObstacleProblem({.load = "x"}).status().message(), HasSubstr("f"));
}

}  // namespace
}  // namespace dlcs
