// SPDX-License-Identifier: Apache-2.0

#include "core/discretization/grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stop_token>

#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

using ::testing::ElementsAre;

TEST(GridTest, TakesAThousandStepsUnlessTold) {
  const Grid grid = MakeGrid(2, {}, {});
  EXPECT_EQ(grid.num_steps(), 1000);
  EXPECT_DOUBLE_EQ(grid.longest_step, 0.002);
  EXPECT_EQ(grid.times.front(), 0);
  EXPECT_EQ(grid.times.back(), 2);
  EXPECT_EQ(grid.output_nodes.size(), 1001u);
}

TEST(GridTest, MakesBreakPointsNodesWithStepsNoLongerThanAsked) {
  Options options;
  options.num_steps = 10;
  const Grid grid = MakeGrid(1, {0.25, 0.6}, options);
  ASSERT_EQ(grid.runs.size(), 3u);
  EXPECT_EQ(grid.runs[0].steps, 3);
  EXPECT_EQ(grid.runs[1].steps, 4);
  EXPECT_EQ(grid.runs[2].steps, 4);
  EXPECT_EQ(grid.times[3], 0.25);
  EXPECT_EQ(grid.times[7], 0.6);
  for (const dlcs::Run& run : grid.runs) {
    EXPECT_TRUE(run.starts_at_break);
    EXPECT_LE(run.step, 0.1 + 1e-15);
  }
}

TEST(GridTest, LeavesTheGridAloneWhenOutputTimesAreNodes) {
  Options options;
  options.num_steps = 30;
  options.output_times = {0, 0.1, 0.5, 3};
  options.output_times_only = true;
  const Grid grid = MakeGrid(3, {}, options);
  EXPECT_EQ(grid.runs.size(), 1u);
  EXPECT_THAT(grid.output_nodes, ElementsAre(0, 1, 5, 30));
  EXPECT_EQ(grid.times[1], 0.1);  // the caller's own number, not 3 · (1/30)
}

TEST(GridTest, OutputTimesThatAreWrittenWithTenDigitsAreTheNodesTheyMean) {
  Options options;
  options.num_steps = 12;
  options.output_times = {0.08333333333, 0.4166666667, 0.5833333333, 0.9166666667};
  options.output_times_only = true;
  const Grid grid = MakeGrid(1, {}, options);
  EXPECT_EQ(grid.num_steps(), 12);
  EXPECT_THAT(grid.output_nodes, ElementsAre(1, 5, 7, 11));
}

TEST(GridTest, SplitsAStretchAtOutputTimesThatAreNoNodes) {
  Options options;
  options.num_steps = 4;
  options.output_times = {0.3, 0.5};
  const Grid grid = MakeGrid(1, {}, options);
  EXPECT_THAT(grid.times, ElementsAre(0, 0.15, 0.3, 0.5, 0.75, 1));
  EXPECT_TRUE(grid.runs[0].starts_at_break);
  EXPECT_FALSE(grid.runs[1].starts_at_break);  // f and g are smooth at an output time
}

TEST(GridTest, AnOutputTimeThatIsNearABreakPointIsANodeOfItsOwn) {
  // A layer behind 0 or a break point may be shorter than a billionth of a step.
  Options options;
  options.num_steps = 2;
  options.output_times = {1e-14, 2e-14, 0.5 - 1e-14, 0.5 + 1e-14, 1};
  options.output_times_only = true;
  const Grid grid = MakeGrid(1, {0.5}, options);
  EXPECT_THAT(grid.times, ElementsAre(0, 1e-14, 2e-14, 0.5 - 1e-14, 0.5, 0.5 + 1e-14, 1));
  EXPECT_THAT(grid.output_nodes, ElementsAre(1, 2, 3, 5, 6));
  EXPECT_EQ(grid.runs[0].step, 1e-14);
}

TEST(GridTest, StepsOfDifferentLengthNearZeroAreDifferentRuns) {
  Options options;
  options.grid_times = {1e-17, 4e-17, 1};
  const Grid grid = MakeGrid(1, {}, options);
  EXPECT_THAT(grid.times, ElementsAre(0, 1e-17, 4e-17, 1));
  ASSERT_EQ(grid.runs.size(), 3u);
  EXPECT_DOUBLE_EQ(grid.runs[1].step, 3e-17);
}

TEST(GridTest, TakesAStepLongerThanTheHorizonAsOneStep) {
  Options options;
  options.step = 5;
  EXPECT_EQ(MakeGrid(1, {}, options).num_steps(), 1);
}

TEST(GridTest, HalvesEveryStepAndKeepsOutputTimes) {
  Options options;
  options.num_steps = 2;
  options.output_times = {0.7};
  options.output_times_only = true;
  const Grid grid = MakeGrid(1, {}, options);
  const Grid halved = Halve(grid);
  EXPECT_EQ(halved.num_steps(), 2 * grid.num_steps());
  ASSERT_EQ(halved.output_nodes.size(), 1u);
  EXPECT_EQ(halved.times[halved.output_nodes[0]], 0.7);
  EXPECT_DOUBLE_EQ(halved.runs[0].step, grid.runs[0].step / 2);
}

TEST(GridTest, ComparesWithLongerStepsAndWhereTheyAreFewWithShorterOnes) {
  Options options;
  options.num_steps = 100;
  options.output_times = {0.005, 0.035};  // one step, and three, and 97 of their own length
  options.output_times_only = true;
  const Grid grid = MakeGrid(1, {}, options);
  ASSERT_EQ(grid.num_steps(), 1 + 3 + 97);
  const Grid twice = WithOtherSteps(grid, 2, 1000);
  EXPECT_EQ(twice.num_steps(), 2 + 6 + 49);
  EXPECT_DOUBLE_EQ(twice.times[1], 0.0025);
  EXPECT_EQ(twice.times[2], 0.005);
  EXPECT_EQ(twice.times[8], 0.035);
  EXPECT_GT(twice.longest_step, 0.0198);
  EXPECT_EQ(WithOtherSteps(grid, 4, 1000).num_steps(), 4 + 12 + 25);
}

TEST(GridTest, TakesTheNodesThatAreGiven) {
  Options options;
  options.grid_times = {0.1, 0.2, 0.3, 0.35, 0.4, 0.9};
  options.output_times = {0.3, 0.5};
  const Grid grid = MakeGrid(1, {0.35}, options);
  EXPECT_THAT(grid.times, ElementsAre(0, 0.1, 0.2, 0.3, 0.35, 0.4, 0.5, 0.9, 1));
  // 3 × 0.1, 0.05, and behind the break point 0.05, 0.1, 0.4, 0.1.
  ASSERT_EQ(grid.runs.size(), 6u);
  EXPECT_EQ(grid.runs[0].steps, 3);
  EXPECT_DOUBLE_EQ(grid.runs[0].step, 0.1);
  EXPECT_TRUE(grid.runs[0].starts_at_break);
  EXPECT_FALSE(grid.runs[1].starts_at_break);
  EXPECT_TRUE(grid.runs[2].starts_at_break);
  EXPECT_EQ(grid.runs[2].begin, 0.35);
  EXPECT_EQ(grid.runs[4].step, 0.4);
  EXPECT_DOUBLE_EQ(grid.longest_step, 0.4);
  EXPECT_EQ(grid.output_nodes.size(), 9u);
}

TEST(GridTest, KeepsGivenNodesThatAreVeryClose) {
  Options options;
  options.grid_times = {1e-13, 1e-12, 0.5};
  EXPECT_THAT(MakeGrid(1, {}, options).times, ElementsAre(0, 1e-13, 1e-12, 0.5, 1));
  // 0.1 + 0.2 and 0.3 are one time, rounded twice; the caller's output time stays.
  options.grid_times = {0.1 + 0.2};
  options.output_times = {0.3};
  EXPECT_THAT(MakeGrid(1, {}, options).times, ElementsAre(0, 0.3, 1));
}

TEST(GridTest, FindsTheRunsOfAUniformGridInItsTimes) {
  const Grid uniform = MakeGrid(0.7, {}, {});
  Options options;
  options.grid_times = uniform.times;
  const Grid given = MakeGrid(0.7, {}, options);
  EXPECT_EQ(given.times, uniform.times);
  ASSERT_EQ(given.runs.size(), 1u);
  EXPECT_EQ(given.runs[0].steps, 1000);
  EXPECT_DOUBLE_EQ(given.runs[0].step, uniform.runs[0].step);
}

TEST(GridTest, AGridOfManyNodesCanBeStopped) {
  Options options;
  options.num_steps = 1'000'000;
  std::stop_source source;
  source.request_stop();
  const StopScope scope(source.get_token());
  EXPECT_THROW(MakeGrid(1, {}, options), Stopped);
}

}  // namespace
}  // namespace dlcs
