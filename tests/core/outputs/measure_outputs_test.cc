// SPDX-License-Identifier: Apache-2.0
// Outputs and measurements against closed forms.
#include "core/outputs/measure_outputs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/format_number.h"
#include "core/outputs/output_curves.h"
#include "core/outputs/output_evaluator.h"
#include "core/problem/verdict.h"
#include "core/solve.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;

// x = (cos 2πt, -sin 2πt), y = max(0, sin 2πt), and four outputs: x1, y, 2 x2 + 3 + sin 4πt, and a step at 1/2 of which
// f and g know nothing.
Problem Oscillator(double horizon) {
  Problem problem;
  problem.A = (Matrix(2, 2) << 0, 2 * pi, -2 * pi, 0).finished();
  problem.B = Matrix::Zero(2, 1);
  problem.N = Matrix::Zero(1, 2);
  problem.M = Matrix::Identity(1, 1);
  problem.f = TimeFunction::Zero(2);
  problem.g = TimeFunction::Formulas({"-sin(2*pi*t)"});
  problem.x0 = (Vector(2) << 1, 0).finished();
  problem.horizon = horizon;
  Outputs& outputs = problem.outputs;
  outputs.names = {"c", "y", "s", "step"};
  outputs.C = (Matrix(4, 2) << 1, 0, 0, 0, 0, 2, 0, 0).finished();
  outputs.D = (Matrix(4, 1) << 0, 1, 0, 0).finished();
  outputs.h = TimeFunction::Formulas({"0", "0", "3+sin(4*pi*t)", "4*(t>=0.5)-1"});
  return problem;
}

Options Tight() {
  Options options;
  options.error_tolerance = 1e-11;
  return options;
}

Measurement OverTime(MeasurementKind kind, std::vector<Index> outputs, double begin, std::optional<double> end = {}) {
  return {.name = "", .kind = kind, .outputs = std::move(outputs), .begin = begin, .end = end};
}

MeasurementInstant Crossing(Index output, double level, CrossingDirection direction, int number, double after = 0) {
  return {.time = {}, .outputs = {output}, .level = level, .direction = direction, .number = number, .after = after};
}

Measurement When(MeasurementInstant instant) {
  return {.name = "", .kind = MeasurementKind::kTime, .outputs = {}, .end = {}, .at = std::move(instant)};
}

std::vector<MeasurementResult> Measured(Problem problem, std::vector<Measurement> measurements,
                                        const Options& options) {
  for (std::size_t k = 0; k < measurements.size(); ++k) measurements[k].name = "m" + std::to_string(k);
  problem.measurements = std::move(measurements);
  EXPECT_TRUE(Validate(problem).empty());
  return testing::SolveToEnd(problem, options).measurements;
}

TEST(MeasureOutputsTest, IntegralsAreThoseOfTheExactSolution) {
  const auto results = Measured(
      Oscillator(2),
      {OverTime(MeasurementKind::kAverage, {1}, 0), OverTime(MeasurementKind::kRms, {1}, 0),
       OverTime(MeasurementKind::kIntegral, {0}, 0.1, 0.35), OverTime(MeasurementKind::kAverage, {2}, 0.5, 1.5),
       OverTime(MeasurementKind::kRms, {2}, 0, 1), OverTime(MeasurementKind::kAverage, {3}, 0),
       OverTime(MeasurementKind::kRms, {3}, 0.25, 0.75), OverTime(MeasurementKind::kAverage, {0, 0}, 0, 1),
       OverTime(MeasurementKind::kRms, {0, 3}, 0, 1), OverTime(MeasurementKind::kAverage, {1, 3}, 0, 1)},
      Tight());
  EXPECT_NEAR(*results[0].value, 1 / pi, 1e-10);
  EXPECT_NEAR(*results[1].value, 0.5, 1e-10);
  EXPECT_NEAR(*results[2].value, (std::sin(0.7 * pi) - std::sin(0.2 * pi)) / (2 * pi), 1e-10);
  EXPECT_NEAR(*results[3].value, 3, 1e-10);
  // (3 - 2 sin a + sin 2a)²: 9 + 2 + 1/2.
  EXPECT_NEAR(*results[4].value, std::sqrt(11.5), 1e-10);
  EXPECT_NEAR(*results[5].value, 0.25 * -1 + 0.75 * 3, 1e-12);
  EXPECT_NEAR(*results[6].value, std::sqrt(0.5 * 1 + 0.5 * 9), 1e-12);
  EXPECT_NEAR(*results[7].value, 0.5, 1e-10);
  EXPECT_NEAR(*results[8].value, std::sqrt((0.25 * 1 + 0.25 * 9)), 1e-10);
  EXPECT_NEAR(*results[9].value, -1 / pi, 1e-10);  // y is not 0 where the step is -1
}

TEST(MeasureOutputsTest, ExtremesHaveTheirTimes) {
  const auto results =
      Measured(Oscillator(1.9),
               {OverTime(MeasurementKind::kMaximum, {1}, 0), OverTime(MeasurementKind::kMinimum, {0}, 0.6),
                OverTime(MeasurementKind::kPeakToPeak, {2}, 0, 1), OverTime(MeasurementKind::kMinimum, {3}, 0.4),
                OverTime(MeasurementKind::kMaximum, {0}, 0.1, 0.2)},
               Tight());
  EXPECT_NEAR(*results[0].value, 1, 1e-10);
  EXPECT_NEAR(*results[0].time, 0.25, 1e-5);
  EXPECT_NEAR(*results[1].value, -1, 1e-10);
  EXPECT_NEAR(*results[1].time, 1.5, 1e-5);
  // -2 sin a + sin 2a lies between -3√3/2 and 3√3/2.
  EXPECT_NEAR(*results[2].value, 3 * std::sqrt(3), 1e-10);
  EXPECT_EQ(*results[3].value, -1);
  EXPECT_NEAR(*results[4].value, std::cos(0.2 * pi), 1e-10);
  EXPECT_NEAR(*results[4].time, 0.1, 1e-12);
}

TEST(MeasureOutputsTest, CrossingsAreCountedByDirection) {
  using enum CrossingDirection;
  const auto at = [](MeasurementInstant instant) { return When(std::move(instant)); };
  const auto results =
      Measured(Oscillator(3),
               {at(Crossing(1, 0.5, kRising, 1)), at(Crossing(1, 0.5, kRising, 3)), at(Crossing(1, 0.5, kFalling, 2)),
                at(Crossing(1, 0.5, kEither, 4)), at(Crossing(1, 0.5, kEither, MeasurementInstant::kLast)),
                at(Crossing(1, 0.5, kRising, 1, 1.5)), at(Crossing(3, 0, kRising, 1)), at(Crossing(1, 0.5, kRising, 4)),
                at(Crossing(1, 2, kEither, 1)), at(Crossing(3, 0, kFalling, 1)), at(Crossing(1, 0, kRising, 2))},
               Tight());
  EXPECT_NEAR(*results[0].value, 1.0 / 12, 1e-11);
  EXPECT_NEAR(*results[1].value, 2 + 1.0 / 12, 1e-11);
  EXPECT_NEAR(*results[2].value, 1 + 5.0 / 12, 1e-11);
  EXPECT_NEAR(*results[3].value, 1 + 5.0 / 12, 1e-11);
  EXPECT_NEAR(*results[4].value, 2 + 5.0 / 12, 1e-11);
  EXPECT_NEAR(*results[5].value, 2 + 1.0 / 12, 1e-11);
  EXPECT_EQ(*results[6].value, 0.5);  // a jump
  EXPECT_FALSE(results[7].value.has_value());
  EXPECT_EQ(results[7].reason, "y crosses 0.5 upwards, but only 3 times.");
  EXPECT_EQ(results[8].reason, "y crosses 2 at no time.");
  EXPECT_EQ(results[9].reason, "step crosses 0 downwards at no time.");
  // y rests on 0, and never comes from below.
  EXPECT_FALSE(results[10].value.has_value()) << *results[10].value;
}

// x(0) = start, x' = slope, on [0, 20], with the output a = x.
Problem Curve(const std::string& slope, double start) {
  Problem problem;
  problem.A = problem.B = problem.N = Matrix::Zero(1, 1);
  problem.M = Matrix::Identity(1, 1);
  problem.f = TimeFunction::Formulas({slope});
  problem.g = TimeFunction::Formulas({"1"});
  problem.x0 = Vector::Constant(1, start);
  problem.horizon = 20;
  problem.outputs.names = {"a"};
  problem.outputs.C = Matrix::Identity(1, 1);
  problem.outputs.D = Matrix::Zero(1, 1);
  problem.outputs.h = TimeFunction::Zero(1);
  return problem;
}

// The steps of x, of which there is one here, know nothing of h.
TEST(MeasureOutputsTest, FollowsOutputsHoweverFastTheyAre) {
  struct Source {
    const char* h;
    double horizon, maximum, integral;
  };
  const double root = std::sqrt(pi);
  for (const Source& source :
       {Source{"sin(50*t)", 6, 1, (1 - std::cos(300)) / 50}, Source{"sin(2*t)", 1000, 1, (1 - std::cos(2000)) / 2},
        Source{"100*exp(-((t-1.23456)/1e-1)**2)", 6, 100, 10 * root},
        Source{"100*exp(-((t-1.23456)/1e-3)**2)", 6, 100, 0.1 * root},
        Source{"100*exp(-((t-1.23456)/1e-6)**2)", 6, 100, 1e-4 * root},
        Source{"1/(1+100*(t-2.7)**2)", 6, 1, (std::atan(33) + std::atan(27)) / 10}}) {
    SCOPED_TRACE(source.h);
    Problem problem = Curve("0", 0);
    problem.horizon = source.horizon;
    problem.outputs.h = TimeFunction::Formulas({source.h});
    const auto results = Measured(
        problem, {OverTime(MeasurementKind::kMaximum, {0}, 0), OverTime(MeasurementKind::kIntegral, {0}, 0)}, {});
    EXPECT_NEAR(*results[0].value, source.maximum, 1e-9 * source.maximum);
    EXPECT_NEAR(*results[1].value, source.integral, 1e-11 * source.maximum * source.horizon);
  }
}

// -(t - 1.03)² is a polynomial on the whole interval; sin t is above 0.99999 for 0.009.
TEST(MeasureOutputsTest, FindsCrossingsHoweverCloseTogether) {
  using enum CrossingDirection;
  for (const double distance : {1e-2, 1e-3, 1e-4}) {
    const auto results = Measured(
        Curve("-2*(t-1.03)", -1.03 * 1.03),
        {When(Crossing(0, -distance * distance, kRising, 1)), When(Crossing(0, -distance * distance, kFalling, 1)),
         When(Crossing(0, -distance * distance, kEither, MeasurementInstant::kLast))},
        Tight());
    ASSERT_TRUE(results[0].value && results[1].value) << results[0].reason << results[1].reason;
    EXPECT_NEAR(*results[0].value, 1.03 - distance, 1e-12 / distance);
    EXPECT_NEAR(*results[1].value, 1.03 + distance, 1e-12 / distance);
    EXPECT_EQ(*results[2].value, *results[1].value);
  }
  for (const double level : {0.999, 0.9999, 0.99999, 0.999999, 0.9999999}) {
    const auto results = Measured(Curve("cos(t)", 0),
                                  {When(Crossing(0, level, kRising, 1)), When(Crossing(0, level, kFalling, 3)),
                                   When(Crossing(0, level, kEither, 7))},
                                  Tight());
    ASSERT_TRUE(results[0].value && results[1].value) << results[0].reason << results[1].reason;
    EXPECT_NEAR(*results[0].value, std::asin(level), 1e-7);
    EXPECT_NEAR(*results[1].value, 5 * pi - std::asin(level), 1e-7);
    EXPECT_EQ(results[2].reason, "a crosses " + NumberText(level) + ", but only 6 times.");
  }
}

// (t - 5)(t - 5.001) is below -2.4e-7 for 2e-4.
TEST(MeasureOutputsTest, FindsCrossingsOfProducts) {
  Problem problem = Curve("1", -5);
  problem.outputs.names = {"a", "b"};
  problem.outputs.C = Matrix::Ones(2, 1);
  problem.outputs.D = Matrix::Zero(2, 1);
  problem.outputs.h = TimeFunction::Formulas({"0", "-1e-3"});
  MeasurementInstant crossing = Crossing(0, -2.4e-7, CrossingDirection::kFalling, 1);
  crossing.outputs = {0, 1};
  const auto results = Measured(problem, {When(crossing), OverTime(MeasurementKind::kMinimum, {0, 1}, 0)}, Tight());
  ASSERT_TRUE(results[0].value) << results[0].reason;
  EXPECT_NEAR(*results[0].value, 5 + 4e-4, 1e-6);
  EXPECT_NEAR(*results[1].value, -0.25e-6, 1e-11);
  EXPECT_NEAR(*results[1].time, 5 + 5e-4, 1e-9);
}

TEST(MeasureOutputsTest, AReasonNamesTheLevelInFull) {
  EXPECT_EQ(
      Measured(Curve("cos(t)", 0), {When(Crossing(0, 1.0000001, CrossingDirection::kRising, 1))}, Tight())[0].reason,
      "a crosses 1.0000001 upwards at no time.");
}

// The top of 1 - (t - 1.03)² is above 1 - 1e-6 for 0.002.
TEST(MeasureOutputsTest, ALimitIsReachedAtItsTime) {
  Problem problem = Curve("-2*(t-1.03)", 1 - 1.03 * 1.03);
  problem.horizon = 2;
  problem.outputs.limits = {{0, (1 - 1e-6) / kReachedLimit}};
  const Solution solution = testing::SolveToEnd(problem, Tight());
  ASSERT_EQ(solution.reached_limits.size(), 1);
  EXPECT_THAT(solution.reached_limits[0], HasSubstr(" at t = 1.029:"));
}

// Of pieces below the levels no curves are made; those of the others are the same. The h of the third output varies, so
// all of its pieces are kept.
TEST(MeasureOutputsTest, CurvesBelowTheirLevelsMayBeLeftOut) {
  const Problem problem = Oscillator(2);
  Options options = Tight();
  options.keep_pieces = true;
  const Solution solution = testing::SolveToEnd(problem, options);
  const auto all = OutputCurves(problem, solution, {0, 3});
  const auto most = OutputCurves(problem, solution, {0, 3}, Vector{{10, 2}});
  const auto none = OutputCurves(problem, solution, {0, 3}, Vector{{10, 10}});
  ASSERT_TRUE(all.ok() && most.ok() && none.ok());
  EXPECT_TRUE(none->empty());
  EXPECT_LT(most->size(), all->size());
  for (const CurvePiece& piece : *all) {
    const auto same =
        std::find_if(most->begin(), most->end(), [&](const auto& kept) { return kept.begin == piece.begin; });
    EXPECT_EQ(same != most->end(), piece.begin >= 0.5) << piece.begin;  // where the step is 3
    if (same != most->end()) {
      EXPECT_EQ(same->z, piece.z);
    }
  }
  EXPECT_EQ(OutputCurves(problem, solution, {2}, Vector{{100}})->size(), OutputCurves(problem, solution, {2})->size());
}

// x rises to 1 - 1/e by 0.501 and decays again, at the rate 1000; its limit is 0.5.
Problem ShortPulse() {
  Problem problem = Curve("1000*((t>0.5)-(t>0.501))", 0);
  problem.A = Matrix::Constant(1, 1, -1000);
  problem.horizon = 1;
  problem.outputs.limits = {{0, 0.5}};
  return problem;
}

TEST(MeasureOutputsTest, ALimitIsReachedBetweenNodesOfTheSolve) {
  Problem problem = ShortPulse();
  Options options;
  options.method = Method::kExponentialIntegrator;
  options.output_times = {0.1, 1};
  options.output_times_only = true;
  options.num_steps = 7;
  const Solution few = testing::SolveToEnd(problem, options);
  ASSERT_EQ(few.reached_limits.size(), 1);
  EXPECT_EQ(few.times.size(), 2);
  EXPECT_THAT(few.reached_limits[0], HasSubstr("a reaches its limit 0.5 between t = 0.5 and t = 0.501:"));
  // Nodes between 0.5 and 0.501, the first behind 0.500693.
  options.num_steps = 10000;
  const Solution many = testing::SolveToEnd(problem, options);
  ASSERT_EQ(many.reached_limits.size(), 1);
  EXPECT_THAT(many.reached_limits[0], HasSubstr(" between t = 0.5006 and t = 0.5007:"));
  options.output_times = {0.1, 0.501, 1};
  EXPECT_EQ(testing::SolveToEnd(problem, options).reached_limits, many.reached_limits);
  problem.outputs.limits = {{0, 0.65}};
  EXPECT_TRUE(testing::SolveToEnd(problem, options).reached_limits.empty());
}

// Keeps the first checkpoint behind 0.6.
class LateCheckpoint : public Observer {
 public:
  bool WantsCheckpoint() override { return point_.state.empty(); }
  void OnCheckpoint(const Checkpoint& checkpoint) override {
    const Solution& solution = checkpoint.solution;
    const Index columns = checkpoint.first + checkpoint.count;
    point_ = {checkpoint.time < 0.6 ? "" : checkpoint.state(), solution.x.leftCols(columns),
              solution.y.leftCols(columns), solution.w.leftCols(columns)};
  }
  const ResumePoint& point() const { return point_; }

 private:
  ResumePoint point_;
};

TEST(MeasureOutputsTest, AResumedSolveKnowsTheLimitsReachedBefore) {
  const Problem problem = ShortPulse();
  Options options;
  options.method = Method::kTimeStepping;
  options.num_steps = 10000;
  options.output_times = {0.1, 1};
  options.output_times_only = true;
  LateCheckpoint observer;
  const auto whole = Solve(problem, options, observer, {});
  ASSERT_TRUE(whole.ok()) << whole.status();
  ASSERT_FALSE(observer.point().state.empty());
  Observer none;
  const auto resumed = Solve(problem, options, none, {}, nullptr, &observer.point());
  ASSERT_TRUE(resumed.ok()) << resumed.status();
  EXPECT_EQ(whole->reached_limits.size(), 1);
  EXPECT_EQ(resumed->reached_limits, whole->reached_limits);
}

TEST(MeasureOutputsTest, ValuesAndDelays) {
  using enum CrossingDirection;
  Measurement value{.name = "", .kind = MeasurementKind::kValue, .outputs = {0}, .end = {}};
  value.at = MeasurementInstant{.time = 0.2, .outputs = {}};
  Measurement crossed = value;
  crossed.at = Crossing(1, 0.5, kFalling, 1);
  Measurement delay{.name = "", .kind = MeasurementKind::kDelay, .outputs = {}, .end = {}};
  delay.at = Crossing(1, 0.5, kRising, 2);
  delay.until = Crossing(0, 0, kFalling, 1);
  Measurement none = delay;
  none.until = Crossing(0, 7, kEither, 1);
  Measurement at_jump = value;
  at_jump.outputs = {3};
  at_jump.at->time = 0.5;
  const auto results = Measured(Oscillator(2), {value, crossed, delay, none, at_jump}, Tight());
  EXPECT_NEAR(*results[0].value, std::cos(0.4 * pi), 1e-10);
  EXPECT_EQ(*results[0].time, 0.2);
  EXPECT_NEAR(*results[1].value, std::cos(pi * 5 / 6), 1e-10);
  EXPECT_NEAR(*results[2].value, 0.25 - (1 + 1.0 / 12), 1e-10);  // negative: it ends before it begins
  EXPECT_EQ(results[3].reason, "no end: c crosses 7 at no time.");
  EXPECT_EQ(*results[4].value, 3);  // the limit from the right
}

TEST(MeasureOutputsTest, DoNotDependOnTheOutputTimes) {
  Options few = Tight();
  few.output_times = {2};
  few.output_times_only = true;
  const std::vector<Measurement> all = {OverTime(MeasurementKind::kRms, {0, 1}, 0.3),
                                        OverTime(MeasurementKind::kMaximum, {2}, 0)};
  const auto one = Measured(Oscillator(2), all, few), other = Measured(Oscillator(2), all, Tight());
  for (std::size_t k = 0; k < all.size(); ++k) EXPECT_NEAR(*one[k].value, *other[k].value, 1e-10);
}

TEST(MeasureOutputsTest, MethodsWithStepsMeasureStraightLines) {
  Options options;
  options.method = Method::kExponentialIntegrator;
  options.num_steps = 4000;
  const auto results =
      Measured(Oscillator(2),
               {OverTime(MeasurementKind::kAverage, {1}, 0), When(Crossing(1, 0.5, CrossingDirection::kRising, 2)),
                OverTime(MeasurementKind::kAverage, {3}, 0)},
               options);
  EXPECT_NEAR(*results[0].value, 1 / pi, 1e-6);
  EXPECT_NEAR(*results[1].value, 1 + 1.0 / 12, 1e-6);
  EXPECT_NEAR(*results[2].value, 2, 1e-12);  // the jump of the output is a node
}

TEST(MeasureOutputsTest, WhatLiesBeyondTheEndOfASolutionHasNoValue) {
  // 0 <= y ⟂ 1 - t >= 0 has no solution behind 1.
  Problem problem = Oscillator(2);
  problem.M = Matrix::Zero(1, 1);
  problem.g = TimeFunction::Formulas({"1-t"});
  problem.measurements = {OverTime(MeasurementKind::kAverage, {0}, 0, 0.5),
                          OverTime(MeasurementKind::kAverage, {0}, 0)};
  problem.measurements[0].name = "first";
  problem.measurements[1].name = "whole";
  const Solution solution = testing::SolveWith(problem, Options());
  ASSERT_NE(solution.termination, Termination::kReachedEnd);
  ASSERT_EQ(solution.measurements.size(), 2);
  EXPECT_NEAR(*solution.measurements[0].value, 0, 1e-6);
  EXPECT_THAT(solution.measurements[1].reason, HasSubstr("the trajectory ends at t = "));
}

TEST(MeasureOutputsTest, AnOutputAtItsLimitIsNoSuccess) {
  Problem problem = Oscillator(2);
  problem.outputs.limits = {{0, 5}};
  EXPECT_TRUE(JudgeSolution(testing::SolveToEnd(problem, Tight())).success);
  problem.outputs.limits = {{0, 5}, {1, 0.5}};
  const Solution solution = testing::SolveWith(problem, Tight());
  const Verdict verdict = JudgeSolution(solution);
  EXPECT_FALSE(verdict.success);
  EXPECT_NE(verdict.kind, VerdictKind::kSolved);
  ASSERT_EQ(verdict.concerns.size(), 1);
  EXPECT_THAT(verdict.concerns[0], HasSubstr("y reaches its limit 0.5 at t = 0.08"));
}

// Halves of a piece on which it overflows do so too, without an end.
TEST(MeasureOutputsTest, AnOutputThatOverflowsHasNoValueAndIsAtItsLimit) {
  Problem problem = Oscillator(2);
  problem.outputs.C = (Matrix(4, 2) << 1.7e308, 1.7e308, 0, 0, 0, 2, 0, 0).finished();
  problem.outputs.limits = {{0, 10}};
  const std::vector<Measurement> all = {OverTime(MeasurementKind::kAverage, {0}, 0),
                                        OverTime(MeasurementKind::kMaximum, {0}, 0),
                                        When(Crossing(0, 1, CrossingDirection::kEither, 1))};
  for (const MeasurementResult& result : Measured(problem, all, Tight())) {
    EXPECT_FALSE(result.value) << *result.value;
    EXPECT_THAT(result.reason, HasSubstr("c is not finite from t = "));
  }
  EXPECT_EQ(testing::SolveToEnd(problem, Tight()).reached_limits.size(), 1U);
}

TEST(OutputEvaluatorTest, HasBothLimitsWhereAnOutputJumps) {
  Problem problem = Oscillator(1);
  problem.outputs.hidden = 0;
  const Solution solution = testing::SolveToEnd(problem, Tight());
  auto outputs = OutputEvaluator::Create(problem);
  ASSERT_TRUE(outputs.ok()) << outputs.status();
  const auto count = static_cast<Index>(solution.times.size());
  const Matrix z = outputs->Columns(solution, 0, count);
  bool found = false;
  for (const OutputEvaluator::Limit& limit : outputs->LeftLimits(solution, 0, count)) {
    const Index k = limit.of_solution.column;
    if (solution.times[static_cast<std::size_t>(k)] != 0.5) continue;
    found = true;
    EXPECT_EQ(limit.outputs[3], -1);
    EXPECT_EQ(z(3, k), 3);
    EXPECT_EQ(limit.of_solution.y.size(), 1);
  }
  EXPECT_TRUE(found);
  for (Index k = 0; k < count; ++k) {
    const double t = solution.times[static_cast<std::size_t>(k)];
    EXPECT_NEAR(z(2, k), 3 - 2 * std::sin(2 * pi * t) + std::sin(4 * pi * t), 1e-9) << t;
  }
}

TEST(OutputEvaluatorTest, LeavesOutTheHiddenOnes) {
  Problem problem = Oscillator(1);
  problem.outputs.hidden = 3;
  const Solution solution = testing::SolveToEnd(problem, Options());
  auto outputs = OutputEvaluator::Create(problem);
  ASSERT_TRUE(outputs.ok());
  EXPECT_EQ(outputs->Columns(solution, 0, 1).rows(), 1);
}

}  // namespace
}  // namespace dlcs
