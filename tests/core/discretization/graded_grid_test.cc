// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/graded_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace dlcs {
namespace {

using ::testing::ElementsAre;

Grid Uniform(double horizon, const std::vector<double>& break_points, Index steps) {
  Options options;
  options.num_steps = steps;
  return MakeGrid(horizon, break_points, options);
}

// Each run's steps have its length, its nodes are in `times`, and one run begins where the one before ends.
void ExpectConsistent(const Grid& grid) {
  Index node = 0;
  for (const dlcs::Run& run : grid.runs) {
    ASSERT_EQ(run.first_node, node);
    EXPECT_EQ(grid.times[node], run.begin);
    for (Index k = 0; k < run.steps; ++k, ++node) {
      EXPECT_NEAR(grid.times[node + 1] - grid.times[node], run.step, 1e-12 * run.step + 4e-16 * run.end);
    }
    EXPECT_EQ(grid.times[node], run.end);
    EXPECT_LE(run.step, grid.longest_step);
  }
  EXPECT_EQ(node, grid.num_steps());
}

TEST(GradedGridTest, TakesStepsOfAtMostHalfTheDistanceFromTheLayer) {
  const Grid uniform = Uniform(1, {}, 64);
  const double shortest = 1e-6;
  const Grid graded = GradeBehind(uniform, {0}, shortest, 1000);
  ExpectConsistent(graded);
  for (Index k = 0; k < graded.num_steps(); ++k) {
    const double step = graded.times[k + 1] - graded.times[k];
    EXPECT_LE(step, std::max(shortest, graded.times[k] / 2) * (1 + 1e-9)) << k;
    EXPECT_GE(step, std::min(1.0 / 64, std::max(shortest, graded.times[k] / 2) / 4) * (1 - 1e-9)) << k;
  }
}

TEST(GradedGridTest, KeepsEveryNodeAndTheOutputNodes) {
  Options options;
  options.num_steps = 10;
  options.output_times = {0, 0.1, 0.234, 0.9};
  options.output_times_only = true;
  const Grid grid = MakeGrid(1, {0.5}, options);
  const Grid graded = GradeBehind(grid, {0, 0.5}, 1e-5, 1000);
  ExpectConsistent(graded);
  for (const double t : grid.times) EXPECT_TRUE(std::binary_search(graded.times.begin(), graded.times.end(), t)) << t;
  std::vector<double> outputs;
  for (const Index node : graded.output_nodes) outputs.push_back(graded.times[node]);
  EXPECT_THAT(outputs, ElementsAre(0, 0.1, 0.234, 0.9));
}

TEST(GradedGridTest, AddsStepsAndLengthsInProportionToTheLogarithm) {
  const Grid uniform = Uniform(1, {}, 64);
  const Grid some = GradeBehind(uniform, {0}, 1e-4, 1000), many = GradeBehind(uniform, {0}, 1e-8, 1000);
  EXPECT_LE(many.num_steps() - some.num_steps(), 6 * std::ceil(std::log2(1e4) / 2));
  EXPECT_LE(many.runs.size() - some.runs.size(), std::ceil(std::log2(1e4) / 2));
}

TEST(GradedGridTest, GradesBehindEachLayerAndNoOtherBreakPoint) {
  const Grid uniform = Uniform(1, {0.25, 0.5}, 16);
  const Grid graded = GradeBehind(uniform, {0, 0.5}, 1e-3, 1000);
  ExpectConsistent(graded);
  const auto step_behind = [&](double t) {
    const auto node = std::lower_bound(graded.times.begin(), graded.times.end(), t);
    return *(node + 1) - *node;
  };
  EXPECT_LE(step_behind(0), 1e-3);
  EXPECT_DOUBLE_EQ(step_behind(0.25), 1.0 / 16);
  EXPECT_LE(step_behind(0.5), 1e-3);
  const auto breaks =
      std::count_if(graded.runs.begin(), graded.runs.end(), [](const auto& run) { return run.starts_at_break; });
  EXPECT_EQ(breaks, 3);
}

TEST(GradedGridTest, AddsNoMoreStepsThanAllowed) {
  const Grid uniform = Uniform(1, {0.5}, 64);
  EXPECT_LE(GradeBehind(uniform, {0, 0.5}, 1e-12, 40).num_steps(), 104);
  EXPECT_EQ(GradeBehind(uniform, {0, 0.5}, 1e-12, 0).num_steps(), 64);
}

TEST(GradedGridTest, FindsLayersWhereSourcesJump) {
  Problem problem;
  problem.A = -Matrix::Identity(1, 1);
  problem.B = problem.N = Matrix::Zero(1, 1);
  problem.M = Matrix::Identity(1, 1);
  problem.f = TimeFunction::Formulas({"max(0, t - 0.25) + (t > 0.5)"});
  problem.g = TimeFunction::Constant(Vector::Ones(1));
  problem.x0 = Vector::Zero(1);
  problem.horizon = 1;
  ASSERT_TRUE(Validate(problem).empty());
  absl::StatusOr<Sources> sources = Sources::Create(problem);
  ASSERT_TRUE(sources.ok());
  EXPECT_EQ(BreakPoints(problem).size(), 2u);
  EXPECT_THAT(LayerTimes(problem, *sources), ElementsAre(0, 0.5));
  EXPECT_EQ(FastestStep(problem), 0.25);
}

}  // namespace
}  // namespace dlcs
