// SPDX-License-Identifier: Apache-2.0
// Made-up methods whose errors are known.

#include "core/driver/step_control.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace dlcs {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Differences of one state of size 1.
ComponentValues Of(double difference) { return {Vector::Constant(1, difference)}; }
void Add(double difference, Convergence& convergence) { convergence.Add(Of(difference), difference); }
double ErrorOf(const Convergence& convergence) {
  const double error = convergence.errors().x[0];
  EXPECT_TRUE(error == convergence.relative_error() || std::isnan(error));
  return error;
}

TEST(ConvergenceTest, OfAPowerLawKnowsOrderAndError) {
  for (const double order : {0.5, 1.0, 1.7, 2.0}) {
    Convergence convergence;
    const auto error = [&](int k) { return 3 * std::exp2(-order * k); };
    for (int k = 1; k <= 3; ++k) Add(error(k - 1) - error(k), convergence);
    EXPECT_NEAR(convergence.order(), order, 1e-12);
    EXPECT_NEAR(ErrorOf(convergence), error(3), 1e-12) << order;
  }
}

TEST(ConvergenceTest, TrustsTheWorstOfTheLastTwoRatios) {
  Convergence lucky;
  for (const double difference : {1.0, 0.5, 1e-6}) Add(difference, lucky);
  EXPECT_DOUBLE_EQ(lucky.order(), 1);
  EXPECT_DOUBLE_EQ(ErrorOf(lucky), 0.25);  // what order one lets expect of 0.5
}

TEST(ConvergenceTest, WhatDoesNotChangeShowsNoOrder) {
  Convergence convergence;
  EXPECT_FALSE(convergence.observed_order());
  for (const double difference : {0.0, 0.0, 0.0}) Add(difference, convergence);
  EXPECT_FALSE(convergence.observed_order());
  Convergence of_order_two;
  for (const double difference : {1.0, 0.25}) Add(difference, of_order_two);
  EXPECT_EQ(of_order_two.observed_order(), 2);
}

TEST(ConvergenceTest, OfNumbersThatAreNotFiniteKnowsNothing) {
  Convergence convergence;
  for (const double difference : {1.0, 0.5, kNaN}) Add(difference, convergence);
  EXPECT_TRUE(std::isnan(ErrorOf(convergence)));
}

// A method of first order is not believed to converge faster, and components have errors of their own.
TEST(ConvergenceTest, ExpectsNoMoreThanTheOrderOfTheMethod) {
  Convergence convergence(1);
  for (const double difference : {1.0, 0.25, 0.0625}) {
    convergence.Add({Vector{{difference, difference / 100}}, Vector{{difference / 10}}}, difference);
  }
  EXPECT_DOUBLE_EQ(convergence.order(), 1);
  const ComponentValues errors = convergence.errors();
  EXPECT_DOUBLE_EQ(errors.x[0], 0.25);
  EXPECT_DOUBLE_EQ(errors.x[1], 0.0025);
  EXPECT_DOUBLE_EQ(errors.y[0], 0.025);
}

TEST(RelativeDifferenceTest, ComparesRowsWithTheirOwnSize) {
  const Matrix fine{{100, -200}, {1e-2, 0}, {1e-9, 0}};
  Matrix coarse = fine;
  coarse(0, 1) += 2;
  EXPECT_DOUBLE_EQ(RelativeDifference(coarse, fine), 0.01);
  coarse(1, 0) += 1e-3;
  EXPECT_NEAR(RelativeDifference(coarse, fine), 0.1, 1e-12);
  coarse(2, 1) = 2e-9;  // which is much beside its own 1e-9
  EXPECT_NEAR(RelativeDifference(coarse, fine), 2, 1e-12);
  coarse(2, 1) = kNaN;
  EXPECT_TRUE(std::isnan(RelativeDifference(coarse, fine)));
}

// x = 1 + h^order at every node but the first, y = 0.
struct MadeUpMethod {
  double order = 2;
  Index fails_up_to = 0;  // steps
  Termination failure = Termination::kInfeasible;
  Index solves = 0;

  absl::StatusOr<Solution> operator()(const Grid& grid) {
    ++solves;
    Solution solution;
    if (grid.num_steps() <= fails_up_to) {
      solution.termination = failure;
      return solution;
    }
    solution.termination = Termination::kReachedEnd;
    for (const Index node : grid.output_nodes) solution.times.push_back(grid.times[node]);
    const auto nodes = static_cast<Index>(solution.times.size());
    solution.x = Matrix::Constant(1, nodes, 1 + std::pow(grid.longest_step, order));
    solution.x(0, 0) = 1;
    solution.y = Matrix::Zero(1, nodes);
    return solution;
  }
};

TrialSolves TrialsOf(std::function<absl::StatusOr<Solution>(const Grid&)> solve) {
  return {.solve = std::move(solve),
          .sizes = [](const Solution& solution) { return SizesOf(solution); },
          .rounding_of_terms = [](const ComponentValues& sizes) { return RoundingOfTerms(sizes); },
          .compare = [](const Solution& coarse, const Solution& fine,
                        const ComponentValues& sizes) { return DifferencesBetween(coarse, fine, sizes); },
          .fits = {}};
}

ControlledSolution Control(MadeUpMethod& method, double tolerance, Index most_steps = 1 << 20) {
  Options options;
  options.num_steps = 64;
  options.error_tolerance = tolerance;
  const StepControl control{.options = options, .most_steps = most_steps, .nodes_kept = 4096};
  const TrialSolves trials = TrialsOf(std::ref(method));
  return SolveToTolerance(control, MakeGrid(1, {}, options), trials).value();
}

// x' jumps from 0 to 1 at a time shortly before 1/2, which the method moves to the next node.
absl::StatusOr<Solution> SwitchAtNextNode(const Grid& grid) {
  constexpr double kSwitch = 0.5 - 0.0015;
  const double next = *std::lower_bound(grid.times.begin(), grid.times.end(), kSwitch);
  Solution solution;
  solution.termination = Termination::kReachedEnd;
  for (const Index node : grid.output_nodes) solution.times.push_back(grid.times[node]);
  const auto nodes = static_cast<Index>(solution.times.size());
  solution.x.resize(1, nodes);
  for (Index k = 0; k < nodes; ++k) solution.x(0, k) = std::max(0.0, solution.times[k] - next) + (kSwitch - 0.5);
  solution.y = Matrix::Zero(1, nodes);
  return solution;
}

// Grids of 64 to 512 steps all move the switch to 1/2.
TEST(SolveToToleranceTest, HalvedStepsThatPlaceASwitchAlikeProveNothing) {
  Options options;
  options.num_steps = 64;
  options.error_tolerance = 1e-4;
  const StepControl control{.options = options, .expected_order = 1, .most_steps = 1 << 20, .nodes_kept = 4096};
  TrialSolves trials = TrialsOf(SwitchAtNextNode);
  trials.at_switches = [](const Solution&, const ComponentValues&) { return Of(1); };
  const ControlledSolution result = SolveToTolerance(control, MakeGrid(1, {}, options), trials).value();
  EXPECT_TRUE(result.reached);
  const double size = 0.5;
  EXPECT_LE(std::abs(result.solution.x.rightCols(1)(0, 0) - 0.5) / size, options.error_tolerance);
}

double TrueError(const ControlledSolution& result) { return std::abs(result.solution.x.rightCols(1)(0, 0) - 1); }

double FigureOf(const ControlledSolution& result) { return result.solution.accuracy.errors.x.truncation[0]; }

TEST(SolveToToleranceTest, StopsAtTheFirstGridThatIsFineEnough) {
  for (const double tolerance : {1e-3, 1e-5, 1e-7, 1e-9}) {
    MadeUpMethod method;
    const ControlledSolution result = Control(method, tolerance);
    EXPECT_TRUE(result.reached);
    EXPECT_LE(TrueError(result), tolerance);
    EXPECT_NEAR(FigureOf(result), kSafety * TrueError(result), 0.01 * FigureOf(result));
    // Four trials show the order; after them each is needed.
    if (method.solves > 4) {
      EXPECT_GT(4 * kSafety * TrueError(result), tolerance);
    }
  }
}

TEST(SolveToToleranceTest, KeepsTheNodesOfItsCoarserGridsOnly) {
  MadeUpMethod method;
  const Solution solution = Control(method, 1e-9).solution;
  ASSERT_EQ(solution.times.size(), 4097u);
  EXPECT_EQ(solution.times[1], 1.0 / 4096);
}

TEST(SolveToToleranceTest, TakesShorterStepsWhereTrialsFail) {
  MadeUpMethod method{.fails_up_to = 512};
  EXPECT_TRUE(Control(method, 1e-4).reached);
  MadeUpMethod cancelled{.fails_up_to = 512, .failure = Termination::kCancelled};
  EXPECT_EQ(Control(cancelled, 1e-4).solution.termination, Termination::kCancelled);
  EXPECT_EQ(cancelled.solves, 1);
  MadeUpMethod infeasible{.fails_up_to = std::numeric_limits<Index>::max()};
  EXPECT_EQ(Control(infeasible, 1e-4).solution.termination, Termination::kInfeasible);
  EXPECT_LT(infeasible.solves, 12);
}

TEST(SolveToToleranceTest, SaysWhatItReachedWhereTheBoundOfStepsIsInTheWay) {
  MadeUpMethod method{.order = 1};
  const ControlledSolution result = Control(method, 1e-6, 1 << 14);
  EXPECT_FALSE(result.reached);
  EXPECT_NEAR(FigureOf(result), kSafety * TrueError(result), 0.01 * FigureOf(result));
  EXPECT_NEAR(TrueError(result), 1.0 / (1 << 14), 1e-12);
  MadeUpMethod hopeless{.order = 0.5};
  EXPECT_FALSE(Control(hopeless, 1e-12).reached);
  EXPECT_LT(hopeless.solves, 12);
}

// Far from the answer changes of the data do something else: they are tried at the first trial, and at the first one
// that is accurate to a thousandth.
TEST(SolveToToleranceTest, MeasuresRoundingWhereTrialsAreAccurate) {
  Options options;
  options.num_steps = 64;
  options.error_tolerance = 1e-4;
  const StepControl control{.options = options, .expected_order = 1, .most_steps = 1 << 20, .nodes_kept = 4096};
  MadeUpMethod method{.order = 1};
  TrialSolves trials = TrialsOf(std::ref(method));
  std::vector<double> errors;
  trials.solve_rounded = [&](const Grid& grid, double) {
    errors.push_back(grid.longest_step);
    return method(grid);
  };
  EXPECT_TRUE(SolveToTolerance(control, MakeGrid(1, {}, options), trials).value().reached);
  ASSERT_EQ(errors.size(), 2u);
  EXPECT_EQ(errors[0], 1.0 / 64);
  EXPECT_LE(errors[1], 1e-3);
  EXPECT_GT(4 * errors[1], 1e-3);
}

TEST(KeepTimesTest, TakesLeftLimitsAlong) {
  Solution solution;
  solution.times = {0, 0.5, 1, 2};
  solution.x = Matrix{{1, 2, 3, 4}};
  solution.y = Matrix{{5, 6, 7, 8}};
  solution.w = Matrix{{50, 60, 70, 80}};
  solution.left_limits = {{1, Vector::Constant(1, 9), Vector::Constant(1, 90)},
                          {2, Vector::Constant(1, 10), Vector::Constant(1, 100)}};
  solution.dense_output = DenseOutput{};
  KeepTimes({0, 1}, solution);
  EXPECT_EQ(solution.times, (std::vector<double>{0, 1}));
  EXPECT_EQ(solution.x, (Matrix{{1, 3}}));
  EXPECT_EQ(solution.y, (Matrix{{5, 7}}));
  EXPECT_EQ(solution.w, (Matrix{{50, 70}}));
  ASSERT_EQ(solution.left_limits.size(), 1u);
  EXPECT_EQ(solution.left_limits[0].column, 1);
  EXPECT_EQ(solution.left_limits[0].y[0], 10);
  EXPECT_EQ(solution.left_limits[0].w[0], 100);
  EXPECT_FALSE(solution.dense_output.has_value());
}

}  // namespace
}  // namespace dlcs
