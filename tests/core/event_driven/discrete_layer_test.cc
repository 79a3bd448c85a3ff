// SPDX-License-Identifier: Apache-2.0
#include "core/event_driven/discrete_layer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/format_number.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "core/problem/validate.h"
#include "core/problem/verdict.h"
#include "core/solve.h"
#include "tests/support/discrete_cases.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::DiscreteCase;
using testing::NamedFlip;

// The flips of a solution, those of one time by name where their order is free.
std::vector<NamedFlip> Sorted(std::vector<NamedFlip> flips, bool order_is_free, double same) {
  if (!order_is_free) return flips;
  std::stable_sort(flips.begin(), flips.end(), [same](const NamedFlip& a, const NamedFlip& b) {
    return std::abs(a.time - b.time) > same ? a.time < b.time : a.name < b.name;
  });
  return flips;
}

std::vector<NamedFlip> FlipsOf(const Problem& problem, const Solution& solution) {
  std::vector<NamedFlip> flips;
  for (const SwitchFlip& flip : solution.flips) {
    flips.push_back({flip.time, problem.switching.switches[static_cast<std::size_t>(flip.index)].name, flip.value});
  }
  return flips;
}

// A word of the message for each reason of the cases.
std::string WordOf(const std::string& refused) {
  if (refused == "race") return "Race";
  if (refused == "no state lasts") return "No state of switches lasts";
  if (refused == "two resets of one state") return "Two resets write one state";
  if (refused == "accumulation") return "accumulate";
  return refused;
}

void ExpectSolved(const DiscreteCase& the_case, const Solution& solution) {
  EXPECT_TRUE(JudgeSolution(solution).success) << solution.message;
  const double exact = 1e-10 * the_case.problem.horizon;
  const std::vector<NamedFlip> expected = Sorted(the_case.flips, the_case.order_is_free, exact);
  const std::vector<NamedFlip> found = Sorted(FlipsOf(the_case.problem, solution), the_case.order_is_free, exact);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(found[k].name, expected[k].name) << k;
    EXPECT_EQ(found[k].value, expected[k].value) << k;
    EXPECT_NEAR(found[k].time, expected[k].time, exact) << k;
  }
  const Vector end = testing::LastState(solution);
  for (Index i = 0; the_case.end && i < end.size(); ++i) {
    const double size = solution.x.row(i).cwiseAbs().maxCoeff();
    EXPECT_NEAR(end[i], (*the_case.end)[i], 1e-10 * size) << i;
  }
}

void ExpectRefused(const DiscreteCase& the_case, const Solution& solution) {
  EXPECT_EQ(solution.termination, Termination::kInfeasible);
  EXPECT_NE(solution.message.find(WordOf(the_case.refused)), std::string::npos) << solution.message;
  const double time = the_case.refused_at;
  EXPECT_NEAR(solution.failure_time, time, 1e-6 * the_case.problem.horizon) << solution.message;
  EXPECT_NE(solution.message.find("t = " + FormatNumber(time)), std::string::npos) << solution.message;
  for (const std::string& name : the_case.names) {
    // Resets write states, which have no names here.
    if (the_case.refused == "two resets of one state") continue;
    EXPECT_NE(solution.message.find(name), std::string::npos) << solution.message;
  }
}

void Expect(const DiscreteCase& the_case) {
  EXPECT_TRUE(Validate(the_case.problem).empty());
  const Solution solution = testing::SolveWith(the_case.problem, {});
  if (the_case.refused.empty()) {
    ExpectSolved(the_case, solution);
  } else {
    ExpectRefused(the_case, solution);
  }
}

class DiscreteCasesTest : public ::testing::TestWithParam<std::string> {};

TEST_P(DiscreteCasesTest, IsSolvedOrRefusedByName) { Expect(testing::LoadDiscreteCase(GetParam())); }

TEST_P(DiscreteCasesTest, InOtherUnitsItIsTheSame) {
  DiscreteCase the_case = testing::LoadDiscreteCase(GetParam());
  testing::ChangeUnits({std::ldexp(1.0, 13), std::ldexp(1.0, -7)}, {0.001, std::ldexp(1.0, 20)}, std::ldexp(1.0, -10),
                       the_case);
  Expect(the_case);
}

TEST_P(DiscreteCasesTest, InAnotherOrderItIsTheSame) {
  DiscreteCase the_case = testing::LoadDiscreteCase(GetParam());
  if (the_case.file_order_decides) return;
  testing::ReverseSwitches(the_case);
  the_case.order_is_free = true;
  Expect(the_case);
}

INSTANTIATE_TEST_SUITE_P(Cases, DiscreteCasesTest, ::testing::ValuesIn(testing::DiscreteCaseNames()),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

// x' = a x + f, with one switch on x that adds `of_switch` to x'.
Problem Switched(double a, double f, double x0, double horizon, double of_switch, double on, double off) {
  Problem problem;
  problem.A = Matrix::Constant(1, 1, a);
  problem.f = TimeFunction::Constant(Vector::Constant(1, f));
  problem.x0 = Vector::Constant(1, x0);
  problem.horizon = horizon;
  Switching& switching = problem.switching;
  switching.switches = {{.name = "S", .set = {{0, on}}, .reset = {{0, off, true}}}};
  switching.F = Matrix::Constant(1, 1, of_switch);
  switching.C = Matrix::Identity(1, 1);
  return problem;
}

// A thermostat heats from 0.5 below 1 to 2: x' = -x + 3 (1 - s).
TEST(DiscreteLayerTest, AThermostatSwitchesForeverAtItsTimes) {
  const Problem problem = Switched(-1, 3, 0.5, 20, -3, 2, 1);
  const Solution solution = testing::SolveForEnd(problem);
  ASSERT_TRUE(JudgeSolution(solution).success) << solution.message;
  double time = std::log(2.5);
  std::size_t k = 0;
  for (bool on = true; time < problem.horizon; on = !on, ++k) {
    ASSERT_LT(k, solution.flips.size());
    EXPECT_NEAR(solution.flips[k].time, time, 1e-10) << k;
    EXPECT_LE(std::abs(solution.flips[k].time - time), 10 * solution.flips[k].error) << k;
    EXPECT_EQ(solution.flips[k].value, on);
    time += std::log(2.0);
  }
  EXPECT_EQ(solution.flips.size(), k);
}

// 40 thermostats that do not act on each other, all alike: they flip at one time, in no order that matters.
TEST(DiscreteLayerTest, SwitchesThatDoNotActOnEachOtherHaveNoOrder) {
  constexpr Index kCount = 40;
  Problem problem;
  problem.A = -Matrix::Identity(kCount, kCount);
  problem.f = TimeFunction::Constant(Vector::Constant(kCount, 3));
  problem.x0 = Vector::Constant(kCount, 0.5);
  problem.horizon = 2;
  Switching& switching = problem.switching;
  for (Index i = 0; i < kCount; ++i) {
    switching.switches.push_back({.name = "S" + std::to_string(i), .set = {{i, 2}}, .reset = {{i, 1, true}}});
  }
  switching.F = -3 * Matrix::Identity(kCount, kCount);
  switching.C = Matrix::Identity(kCount, kCount);
  const Solution solution = testing::SolveForEnd(problem);
  ASSERT_TRUE(JudgeSolution(solution).success) << solution.message;
  ASSERT_EQ(solution.flips.size(), static_cast<std::size_t>(2 * kCount));
  const Vector end = testing::LastState(solution);
  const double exact = 3 - 2 * std::exp(-(2 - std::log(2.5) - std::log(2.0)));
  for (Index i = 0; i < kCount; ++i) EXPECT_NEAR(end[i], exact, 1e-10);
}

// x = sin t beside a level that it misses by a 1e-9th, or passes by as much: what the solve knows decides.
TEST(DiscreteLayerTest, ALevelThatIsNearlyReached) {
  Problem problem;
  problem.A = (Matrix(2, 2) << 0, 1, -1, 0).finished();
  problem.f = TimeFunction::Zero(2);
  problem.x0 = Vector::Unit(2, 1);
  problem.horizon = 3;
  problem.switching.C = (Matrix(1, 2) << 1, 0).finished();
  problem.switching.F = (Matrix(2, 1) << 0, 1).finished();
  for (const double beyond : {-1e-9, 1e-9}) {
    problem.switching.switches = {{.name = "S", .set = {{0, 1 - beyond}}, .reset = {{0, -2, true}}}};
    const Solution solution = testing::SolveAt(problem, 1e-12);
    EXPECT_EQ(solution.flips.size(), beyond > 0 ? 1U : 0U);
  }
}

// An event moves with its state: of dx/dt that jumps there, the figure holds for what x is off by.
TEST(DiscreteLayerTest, FiguresHoldTheErrorsOfFlips) {
  for (const double tolerance : {1e-4, 1e-7, 1e-10}) {
    SCOPED_TRACE(tolerance);
    const Problem problem = Switched(-1, 3, 0.5, 20, -3, 2, 1);
    const Solution solution = testing::SolveAt(problem, tolerance);
    ASSERT_TRUE(JudgeSolution(solution).success) << solution.message;
    // From the last flip on.
    double time = std::log(2.5);
    bool on = true;
    while (time + std::log(2.0) < problem.horizon) {
      time += std::log(2.0);
      on = !on;
    }
    const double exact = on ? 2 * std::exp(time - 20) : 3 - 2 * std::exp(time - 20);
    const double error = std::abs(testing::LastState(solution)[0] - exact);
    EXPECT_LE(error, tolerance * 2);
    EXPECT_LE(error, 3 * testing::FigureOf(solution.accuracy.errors.x) * 2);
  }
}

// A comparator that turns its own control back by value has no state, with hysteresis or without; one that turns it by
// x' alone chatters.
TEST(DiscreteLayerTest, NoStateLastsIsNotChattering) {
  for (const double off : {2.0, 1.5}) {
    Problem problem = Switched(-1, 3, 0.5, 20, 0, 2, off);
    problem.switching.H = Matrix::Constant(1, 1, -1);
    const Solution fed_back = testing::SolveWith(problem, {});
    EXPECT_EQ(fed_back.message.rfind("No state of switches lasts at t = 0.916291: S flips", 0), 0U) << fed_back.message;
  }
  const Solution relay = testing::SolveWith(Switched(-1, 3, 0.5, 20, -3, 2, 2), {});
  EXPECT_EQ(relay.message.rfind("S chatters from t = 0.916291: S needs hysteresis", 0), 0U) << relay.message;
}

// x' = 1 - 2 s with a relay that is late: x swings between -delay and delay, with flips two delays apart.
TEST(DiscreteLayerTest, ALateRelaySwings) {
  constexpr double kDelay = 0.3;
  for (const double tolerance : {1e-4, 1e-8}) {
    Problem problem = Switched(0, 1, -1, 20, -2, 0, 0);
    problem.switching.switches[0].delay = kDelay;
    const Solution solution = testing::SolveAt(problem, tolerance);
    ASSERT_TRUE(JudgeSolution(solution).success) << solution.message;
    ASSERT_EQ(solution.flips.size(), 32U);
    for (std::size_t k = 0; k < solution.flips.size(); ++k) {
      const double time = 1 + kDelay * (2 * static_cast<double>(k) + 1);
      EXPECT_NEAR(solution.flips[k].time, time, 1e-12) << k;
      EXPECT_LE(std::abs(solution.flips[k].time - time), solution.flips[k].error) << k;
      EXPECT_EQ(solution.flips[k].value, k % 2 == 0);
    }
    const double last = solution.flips.back().time;
    EXPECT_NEAR(testing::LastState(solution)[0], -kDelay + 20 - last, 1e-12);
  }
}

// Of pulses of a gate a late comparator follows those that last.
TEST(DiscreteLayerTest, PulsesThatAreShorterThanADelayAreSwallowed) {
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Zero(1);
  problem.x0 = Vector::Zero(1);
  problem.horizon = 4;
  Switching& switching = problem.switching;
  switching.switches = {{.name = "G", .kind = SwitchKind::kGiven, .set = {}, .reset = {}, .edges = {1, 1.05, 2, 2.5}},
                        {.name = "K", .set = {{0, 0.5}}, .reset = {{0, 0.5, true}}, .delay = 0.1}};
  switching.F = (Matrix(1, 2) << 0, 1).finished();
  switching.H = (Matrix(1, 2) << 1, 0).finished();
  const Solution solution = testing::SolveForEnd(problem);
  ASSERT_TRUE(JudgeSolution(solution).success) << solution.message;
  EXPECT_EQ(
      FlipsOf(problem, solution),
      (std::vector<NamedFlip>{
          {1, "G", true}, {1.05, "G", false}, {2, "G", true}, {2.1, "K", true}, {2.5, "G", false}, {2.6, "K", false}}));
  EXPECT_NEAR(testing::LastState(solution)[0], 0.5, 1e-12);
}

// A pair beside a switch: y holds x at zero until the switch drives it up.
TEST(DiscreteLayerTest, PairsAndSwitchesActOnEachOther) {
  Problem problem;
  problem.A = Matrix::Zero(2, 2);
  problem.B = (Matrix(2, 1) << 1, 0).finished();
  problem.N = (Matrix(1, 2) << 1, 0).finished();
  problem.M = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Constant((Vector(2) << -1, 1).finished());
  problem.g = TimeFunction::Zero(1);
  problem.x0 = (Vector(2) << 0.5, 0).finished();
  problem.horizon = 3;
  problem.switching.switches = {{.name = "S", .set = {{0, 2}}, .reset = {}}};
  problem.switching.C = (Matrix(1, 2) << 0, 1).finished();
  problem.switching.F = (Matrix(2, 1) << 3, 0).finished();
  const Solution solution = testing::SolveForEnd(problem);
  ASSERT_TRUE(JudgeSolution(solution).success) << solution.message;
  EXPECT_EQ(solution.y.rows(), 1);
  EXPECT_NEAR(testing::LastState(solution)[0], 2, 1e-10);
  ASSERT_EQ(solution.flips.size(), 1U);
  EXPECT_NEAR(solution.flips[0].time, 2, 1e-12);
}

TEST(DiscreteLayerTest, WhatIsWrongIsNamed) {
  Problem problem = Switched(-1, 3, 0.5, 20, -3, 2, 1);
  Switching& switching = problem.switching;
  switching.switches[0].set[0].control = 1;
  switching.switches.push_back({.name = "S", .kind = SwitchKind::kGiven, .set = {}, .reset = {}, .edges = {2, 1, 30}});
  switching.resets.push_back({.times = {1}, .edge = 2, .J = Matrix::Identity(2, 2), .j = Vector::Zero(1)});
  switching.order = {"T"};
  const std::vector<Violation> violations = Validate(problem);
  std::vector<std::string> fields;
  for (const Violation& violation : violations) fields.push_back(violation.field);
  EXPECT_EQ(fields, (std::vector<std::string>{"switching.F", "switching.switches[0].set[0].control",
                                              "switching.switches[1].name", "switching.switches[1].edges[1]",
                                              "switching.switches[1].edges[2]", "switching.resets[0].edge",
                                              "switching.resets[0].J", "switching.order[0]"}));
}

TEST(DiscreteLayerTest, OtherMethodsRefuseSwitches) {
  const Problem problem = Switched(-1, 3, 0.5, 20, -3, 2, 1);
  Options options;
  options.method = Method::kTimeStepping;
  Observer observer;
  EXPECT_FALSE(Solve(problem, options, observer, {}).ok());
}

}  // namespace
}  // namespace dlcs
