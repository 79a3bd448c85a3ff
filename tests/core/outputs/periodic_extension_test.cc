// SPDX-License-Identifier: Apache-2.0
// Times and windows modulo a period, and measurements of a periodic solution against those of a solve that follows it.

#include "core/outputs/periodic_extension.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/outputs/measure_outputs.h"
#include "core/solve.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;

Measurement Window(MeasurementKind kind, double begin, std::optional<double> end = {}, std::vector<Index> of = {0}) {
  return {.name = "", .kind = kind, .outputs = std::move(of), .begin = begin, .end = end};
}

ExtendedWindow WindowOf(const PeriodicExtension& extension, double begin, std::optional<double> end = {}) {
  const auto window = extension.WindowOf(Window(MeasurementKind::kAverage, begin, end));
  EXPECT_TRUE(std::holds_alternative<ExtendedWindow>(window));
  return std::holds_alternative<ExtendedWindow>(window) ? std::get<ExtendedWindow>(window) : ExtendedWindow{};
}

// Of 1e-5 and 4e-3 neither is a number of double precision, and the remainder of their division is 9.99...e-6.
TEST(PeriodicExtensionTest, MultiplesOfThePeriodAreFoundInSpiteOfRounding) {
  for (const double period : {1e-5, 0.2, 1.0 / 3, 2e-5, 0.7}) {
    const PeriodicExtension extension{.period = period, .horizon = 1e9};
    for (const double cycles : {1.0, 3.0, 7.0, 400.0, 599.0, 123457.0}) {
      const PhasedTime phased = extension.PhaseOf(cycles * period);
      EXPECT_EQ(phased.cycles, cycles) << period;
      EXPECT_EQ(phased.phase, 0) << period;
      const PhasedTime middle = extension.PhaseOf((cycles + 0.5) * period);
      EXPECT_EQ(middle.cycles, cycles) << period;
      EXPECT_NEAR(middle.phase, 0.5 * period, 1e-15 * cycles * period);
    }
  }
  const PhasedTime in_ms = PeriodicExtension{.period = 1e-5, .horizon = 1}.PhaseOf(4e-3);
  EXPECT_EQ(in_ms.cycles, 400);
  EXPECT_EQ(in_ms.phase, 0);
}

TEST(PeriodicExtensionTest, AWindowIsTakenModuloThePeriod) {
  const PeriodicExtension extension{.period = 1e-5, .horizon = 1e-2};
  const ExtendedWindow from = WindowOf(extension, 4e-3);
  EXPECT_EQ(from.whole, 1);
  EXPECT_TRUE(from.parts.empty());
  EXPECT_EQ(from.note, "over one period");
  EXPECT_EQ(WindowOf(extension, 0).note, "");
  const ExtendedWindow inside = WindowOf(extension, 4.002e-3, 4.006e-3);
  ASSERT_EQ(inside.parts.size(), 1u);
  EXPECT_NEAR(inside.parts[0].begin, 2e-6, 1e-18);
  EXPECT_NEAR(inside.parts[0].end, 6e-6, 1e-18);
  EXPECT_EQ(inside.whole, 0);
  EXPECT_EQ(inside.note, "from t = 2e-06 to 6e-06 of the period");
  const ExtendedWindow around = WindowOf(extension, 4.007e-3, 4.013e-3);
  ASSERT_EQ(around.parts.size(), 2u);
  EXPECT_NEAR(around.parts[0].begin, 7e-6, 1e-18);
  EXPECT_EQ(around.parts[0].end, 1e-5);
  EXPECT_EQ(around.parts[1].begin, 0);
  EXPECT_NEAR(around.parts[1].end, 3e-6, 1e-18);
  EXPECT_EQ(around.whole, 0);
  const ExtendedWindow whole = WindowOf(extension, 4e-3, 5e-3);
  EXPECT_EQ(whole.whole, 100);
  EXPECT_TRUE(whole.parts.empty());
  EXPECT_EQ(whole.note, "over 100 equal periods");
  const ExtendedWindow more = WindowOf(extension, 4.007e-3, 4.033e-3);
  EXPECT_EQ(more.whole, 2);
  ASSERT_EQ(more.parts.size(), 2u);
  const ExtendedWindow up_to = WindowOf(extension, 4.007e-3, 4.03e-3);
  EXPECT_EQ(up_to.whole, 2);
  ASSERT_EQ(up_to.parts.size(), 1u);
  for (const ExtendedWindow& one : {inside, around, whole, more, up_to}) {
    double length = one.whole * extension.period;
    for (const ExtendedWindow::Part& part : one.parts) length += part.end - part.begin;
    EXPECT_NEAR(length, one.length, 1e-17);
  }
  const ExtendedWindow as_given = WindowOf(extension, 2e-6, 1e-5);
  EXPECT_EQ(as_given.parts[0].end, 1e-5);
  EXPECT_EQ(as_given.note, "");
}

TEST(PeriodicExtensionTest, AnOscillationHasNoClock) {
  const PeriodicExtension extension{.period = 2, .horizon = 100, .has_clock = false};
  EXPECT_EQ(WindowOf(extension, 50).whole, 1);
  EXPECT_EQ(WindowOf(extension, 50, 57).whole, 1);
  EXPECT_EQ(WindowOf(extension, 50, 57).length, 2);
  EXPECT_EQ(WindowOf(extension, 50, 57).note, "over one period");
  const auto shorter = extension.WindowOf(Window(MeasurementKind::kAverage, 50, 51));
  ASSERT_TRUE(std::holds_alternative<std::string>(shorter));
  EXPECT_THAT(std::get<std::string>(shorter), HasSubstr("shorter than the period 2 of the oscillation"));
}

TEST(PeriodicExtensionTest, CrossingsAreCountedOverPeriods) {
  const PeriodicExtension extension{.period = 0.2, .horizon = 10.03};
  const auto at = [&](int number, double after) {
    return extension.CrossingOf({.time = {}, .outputs = {0}, .number = number, .after = after}, {0, 0.05});
  };
  EXPECT_EQ(at(1, 0), 0.05);
  EXPECT_EQ(at(2, 0), 0.2);
  EXPECT_NEAR(*at(5, 0), 0.45, 1e-15);
  EXPECT_NEAR(*at(1, 0.6), 0.6, 1e-15);  // 3 · 0.2 is more than 0.6
  EXPECT_NEAR(*at(1, 0.61), 0.65, 1e-15);
  EXPECT_NEAR(*at(2, 0.66), 0.85, 1e-15);
  EXPECT_NEAR(*at(MeasurementInstant::kLast, 0), 10, 1e-14);
  EXPECT_FALSE(at(MeasurementInstant::kLast, 10.01));
}

// A square wave charges a capacitor over a diode and a resistance; a load discharges it. Outputs: the voltage, the
// current, the sawtooth of the clock, which jumps where the period begins.
Problem Rectifier(double horizon) {
  Problem problem;
  problem.A = Matrix{{-1 / 3.0}};
  problem.B = Matrix{{1}};
  problem.N = Matrix{{1}};
  problem.M = Matrix{{0.5}};
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Formulas({"1 - 2*((t + 0.03)/0.2 - floor((t + 0.03)/0.2) < 0.5)"});
  problem.x0 = Vector{{0}};
  problem.horizon = horizon;
  problem.outputs.names = {"voltage", "current", "clock"};
  problem.outputs.C = Matrix{{1}, {0}, {0}};
  problem.outputs.D = Matrix{{0}, {1}, {0}};
  problem.outputs.h = TimeFunction::Formulas({"0", "0", "t/0.2 - floor(t/0.2)"});
  return problem;
}

MeasurementInstant CrossingAt(Index output, double level, CrossingDirection direction, int number, double after = 0) {
  return {.time = {}, .outputs = {output}, .level = level, .direction = direction, .number = number, .after = after};
}

Measurement At(MeasurementKind kind, std::vector<Index> of, MeasurementInstant at,
               std::optional<MeasurementInstant> until = {}) {
  return {.name = "", .kind = kind, .outputs = std::move(of), .end = {}, .at = std::move(at), .until = until};
}

Solution Solved(Problem problem, std::vector<Measurement> measurements, double period) {
  for (std::size_t k = 0; k < measurements.size(); ++k) measurements[k].name = "m" + std::to_string(k);
  problem.measurements = std::move(measurements);
  Options options;
  options.period = period;
  options.error_tolerance = 1e-11;
  return testing::SolveToEnd(problem, options);
}

TEST(PeriodicExtensionTest, MeasurementsAreThoseOfASolveThatFollowsThePeriodicSolution) {
  using Kind = MeasurementKind;
  constexpr auto kRising = CrossingDirection::kRising, kFalling = CrossingDirection::kFalling;
  const double mean = Solved(Rectifier(10.1), {}, 0.2).periodic->mean_x[0];
  std::vector<Measurement> measurements;
  for (const Kind kind :
       {Kind::kAverage, Kind::kRms, Kind::kIntegral, Kind::kMinimum, Kind::kMaximum, Kind::kPeakToPeak}) {
    for (const auto& [begin, end] :
         {std::pair(0.02, 0.15), {8.31, 8.35}, {8.36, 8.45}, {8.33, 8.53}, {8.33, 9.21}, {0.01, 0.3}}) {
      for (Index output = 0; output < 3; ++output) measurements.push_back(Window(kind, begin, end, {output}));
      measurements.push_back(Window(kind, begin, end, {0, 1}));
    }
  }
  const MeasurementInstant later{.time = 1.48, .outputs = {}}, seen{.time = 8.09, .outputs = {}};
  for (const Index output : {0, 1}) {
    measurements.push_back(At(Kind::kValue, {output}, later));
    measurements.push_back(At(Kind::kSlope, {output}, later));
    measurements.push_back(At(Kind::kValue, {output}, seen));
  }
  for (const int number : {1, 2, 7, MeasurementInstant::kLast}) {
    for (const double after : {0.0, 1.13}) {
      const MeasurementInstant up = CrossingAt(0, mean, kRising, number, after),
                               tick = CrossingAt(2, 0.5, kRising, number),
                               jump = CrossingAt(2, 0.5, kFalling, number, after),
                               either = CrossingAt(1, 0.2, CrossingDirection::kEither, number, after);
      for (const MeasurementInstant& instant : {up, tick, jump, either}) {
        measurements.push_back(At(Kind::kTime, {}, instant));
        measurements.push_back(At(Kind::kValue, {0}, instant));
      }
      measurements.push_back(At(Kind::kDelay, {}, up, jump));
      measurements.push_back(At(Kind::kDelay, {}, later, either));
    }
  }
  const Solution periodic = Solved(Rectifier(10.1), measurements, 0.2);
  Problem followed = Rectifier(10.1);
  followed.x0 = periodic.x.col(0);
  const Solution transient = Solved(followed, measurements, 0);
  ASSERT_EQ(periodic.measurements.size(), measurements.size());
  int noted = 0;
  for (std::size_t k = 0; k < measurements.size(); ++k) {
    const MeasurementResult &one = periodic.measurements[k], &other = transient.measurements[k];
    ASSERT_TRUE(one.value && other.value) << k << one.reason << other.reason;
    EXPECT_NEAR(*one.value, *other.value, 1e-8) << k << " of kind " << static_cast<int>(measurements[k].kind);
    noted += one.note.empty() ? 0 : 1;
    if (one.time && measurements[k].kind != Kind::kTime) {
      EXPECT_GE(*one.time, 0);
      EXPECT_LE(*one.time, 0.2);
    }
  }
  EXPECT_GT(noted, 100);
}

TEST(PeriodicExtensionTest, WindowsFromATimeOnAreOnePeriod) {
  const Solution solution =
      Solved(Rectifier(10),
             {Window(MeasurementKind::kAverage, 0, {}, {2}), Window(MeasurementKind::kAverage, 4, {}, {2}),
              Window(MeasurementKind::kIntegral, 4, {}, {2}), Window(MeasurementKind::kPeakToPeak, 4.07, {}, {2}),
              Window(MeasurementKind::kMinimum, 0.6, 0.7, {2})},
             0.2);
  EXPECT_NEAR(*solution.measurements[0].value, 0.5, 1e-12);
  EXPECT_EQ(solution.measurements[0].note, "");
  EXPECT_NEAR(*solution.measurements[1].value, 0.5, 1e-12);
  EXPECT_EQ(solution.measurements[1].note, "over one period");
  EXPECT_NEAR(*solution.measurements[2].value, 0.1, 1e-12);
  EXPECT_NEAR(*solution.measurements[3].value, 1, 1e-12);
  // The window begins with a period, and not with the end of the one before.
  EXPECT_NEAR(*solution.measurements[4].value, 0, 1e-12);
}

TEST(PeriodicExtensionTest, AveragesAreThoseOfTheOutputsThatAreShown) {
  Problem problem = Rectifier(10);
  problem.outputs.hidden = 1;
  const Solution solution = Solved(problem, {}, 0.2);
  const PeriodicRecord& record = *solution.periodic;
  ASSERT_EQ(record.mean_outputs.size(), 2);
  EXPECT_NEAR(record.mean_outputs[0], record.mean_x[0], 1e-12);
  EXPECT_NEAR(record.mean_outputs[1], record.mean_y[0], 1e-12);
  EXPECT_NEAR(record.mean_outputs[1], record.mean_outputs[0] / 3, 1e-10);  // the capacitor has no mean current
  EXPECT_EQ(solution.pieces.size(), 0u);
}

TEST(PeriodicExtensionTest, NothingIsMeasuredWithoutAPeriodicSolution) {
  Problem problem = Rectifier(10);
  problem.A = Matrix{{0}};
  problem.B = Matrix{{0}};
  problem.f = TimeFunction::Constant(Vector{{1}});  // x = t
  problem.measurements = {Window(MeasurementKind::kAverage, 4)};
  problem.measurements[0].name = "mean";
  Options options;
  options.period = 0.2;
  Observer silent;
  const auto solution = Solve(problem, options, silent, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_EQ(solution->termination, Termination::kNotPeriodic) << solution->message;
  ASSERT_EQ(solution->measurements.size(), 1u);
  EXPECT_FALSE(solution->measurements[0].value);
  EXPECT_EQ(solution->measurements[0].reason, "no periodic solution was found.");
}

}  // namespace
}  // namespace dlcs
