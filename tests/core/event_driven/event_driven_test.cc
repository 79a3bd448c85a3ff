// SPDX-License-Identifier: Apache-2.0
// Judged by closed forms, by references made with exact exponentials, and by what is known of switching times.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/linalg/norms.h"
#include "core/problem/verdict.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::Case;
using testing::CaseError;
using testing::ErrorOf;
using testing::ExampleFourOne;
using testing::ExampleFourOneExact;
using testing::FourVariableEasy;
using testing::FourVariableHard;
using testing::LastActive;
using testing::LastState;
using testing::LoadCase;
using testing::ReferenceTimes;
using testing::Scalar;
using testing::SolveAt;
using testing::SwitchesOf;

class EventCasesTest : public ::testing::TestWithParam<const char*> {};

// True errors, relative to the largest value, at three tolerances; and the switching times of the reference.
TEST_P(EventCasesTest, ErrorIsBelowTheTolerance) {
  const Case the_case = LoadCase(GetParam());
  for (const double tolerance : {1e-5, 1e-9, 1e-12}) {
    const Solution solution = SolveAt(the_case.problem, tolerance, ReferenceTimes(the_case));
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    // Where an ulp of the data may move a component by more than was asked that is said, though the answer is as good.
    if (tolerance > 1e-12) {
      EXPECT_EQ(JudgeSolution(solution).kind, VerdictKind::kSolved) << JudgeSolution(solution).text;
    }
    const CaseError error = ErrorOf(the_case, solution.times, solution.x, solution.y);
    const double allowed = std::max(tolerance, the_case.reference_accuracy);
    EXPECT_LT(error.x, allowed) << "tolerance " << tolerance;
    EXPECT_LT(error.By, 10 * allowed) << "tolerance " << tolerance;
    if (the_case.y_is_unique) {
      EXPECT_LT(error.y, 10 * allowed) << "tolerance " << tolerance;
    }
    EXPECT_EQ(solution.cost.coupled_steps, 0);
    EXPECT_LT(solution.certificate.node_residual, tolerance * solution.certificate.lcp_scale);
  }
}

TEST_P(EventCasesTest, SwitchingTimesAreThoseOfTheReference) {
  const Case the_case = LoadCase(GetParam());
  const Solution solution = SolveAt(the_case.problem, 1e-10, ReferenceTimes(the_case));
  const std::vector<double> times = SwitchesOf(solution);
  LastActive(solution);
  // The references also list break points at which the active set stays.
  const std::vector<double> breaks = BreakPoints(the_case.problem);
  ASSERT_TRUE(the_case.num_switchings.has_value());
  std::size_t expected = *the_case.num_switchings;
  std::size_t found = 0;
  for (const double expected_time : the_case.switching_times) {
    const bool is_break = std::find(breaks.begin(), breaks.end(), expected_time) != breaks.end();
    if (is_break && (found == times.size() || times[found] > expected_time)) {
      --expected;
      continue;
    }
    ASSERT_LT(found, times.size());
    EXPECT_NEAR(times[found], expected_time, 1e-8 * the_case.problem.horizon) << "switch " << found;
    ++found;
  }
  EXPECT_EQ(times.size(), expected);
}

TEST_P(EventCasesTest, StatesJumpWhereTheReferenceDoes) {
  const Case the_case = LoadCase(GetParam());
  const Solution solution = SolveAt(the_case.problem, 1e-9);
  ASSERT_EQ(solution.jumps.size(), the_case.state_jumps.size());
  for (std::size_t k = 0; k < solution.jumps.size(); ++k) {
    EXPECT_EQ(solution.jumps[k].time, the_case.state_jumps[k].first);
    EXPECT_LT(MaxAbs(solution.jumps[k].dx - the_case.state_jumps[k].second), 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(All, EventCasesTest,
                         ::testing::Values("rlcd", "abb_circuit_a", "observer_lcs", "saturated_pd", "wall_permeable",
                                           "leontief_stock", "train_brakes", "formula_zoo", "z_least", "diode_bridge",
                                           "diode_bridge_cap", "abb_circuit_c", "vickrey", "american_put",
                                           "relay_sliding", "friction_oscillator"),
                         [](const auto& the_case) { return std::string(the_case.param); });

TEST(EventDrivenTest, ReachesEveryToleranceOnExampleFourOne) {
  std::vector<double> times;
  for (int k = 1; k <= 40; ++k) times.push_back(k / 40.0);
  Index first_steps = 0, steps = 0;
  for (const double tolerance : {1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13}) {
    const Solution solution = SolveAt(ExampleFourOne(), tolerance, times);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd);
    double error = 0;
    for (std::size_t k = 0; k < times.size(); ++k) {
      error = NanMax(error, MaxAbs(solution.x.col(static_cast<Index>(k)) - ExampleFourOneExact(times[k])));
    }
    EXPECT_LT(error, tolerance);
    steps = solution.cost.steps;
    if (first_steps == 0) first_steps = steps;
  }
  EXPECT_GT(steps, first_steps);
  EXPECT_LT(steps, 30);
}

// y of the closed form too, between switches where it is not smooth: y = (x1⁺, 0, 0, x1⁻).
TEST(EventDrivenTest, YIsAsAccurateAsX) {
  std::vector<double> times;
  for (int k = 1; k <= 40; ++k) times.push_back(k / 40.0);
  const Solution solution = SolveAt(ExampleFourOne(), 1e-9, times);
  for (std::size_t k = 0; k < times.size(); ++k) {
    const double x1 = ExampleFourOneExact(times[k])[0];
    const Vector y{{std::max(x1, 0.0), 0, 0, std::max(-x1, 0.0)}};
    EXPECT_LT(MaxAbs(solution.y.col(static_cast<Index>(k)) - y), 1e-9) << times[k];
  }
}

TEST(EventDrivenTest, RefiningTheToleranceConvergesOnTheFourVariables) {
  for (const Problem& problem : {FourVariableEasy(), FourVariableHard()}) {
    const Vector best = LastState(SolveAt(problem, 1e-11));
    for (const double tolerance : {1e-3, 1e-5, 1e-7, 1e-9}) {
      EXPECT_LT(MaxAbs(LastState(SolveAt(problem, tolerance)) - best), tolerance);
    }
  }
  const Vector hard = LastState(SolveAt(FourVariableHard(), 1e-9));
  EXPECT_LT(MaxAbs(hard - Vector{{0.091747, -0.200648, 0.497778}}), 1e-6);  // by other methods
}

// The first modes are short, and behind their ends they grow fast: how large x would be there does not count.
TEST(EventDrivenTest, CoarseTolerancesAreMetWhereModesGrowBehindTheirEnds) {
  std::vector<double> times;
  for (int k = 1; k <= 16; ++k) times.push_back(k / 16.0);
  const Solution best = SolveAt(FourVariableEasy(), 1e-11, times);
  const Vector size = RowMaxAbs(best.x);
  for (const double tolerance : {0.05, 0.02, 0.01, 0.005, 0.002}) {
    const Solution solution = SolveAt(FourVariableEasy(), tolerance, times);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    const Vector error = RowMaxAbs(solution.x - best.x);
    EXPECT_LT(MaxAbs(error.cwiseQuotient(size)), tolerance);
  }
}

// x' = -x + y + f with f = -0.5, then -2 from t = 0.7 on; y = max(0, -x).
Vector JumpExact(double t) {
  const double at_jump = -0.5 + 1.5 * std::exp(-0.7);
  const double zero = 0.7 + std::log((at_jump + 2) / 2);
  if (t <= 0.7) return Vector::Constant(1, -0.5 + 1.5 * std::exp(-t));
  if (t <= zero) return Vector::Constant(1, -2 + (at_jump + 2) * std::exp(-(t - 0.7)));
  return Vector::Constant(1, -1 + std::exp(-2 * (t - zero)));
}

TEST(EventDrivenTest, CrossesDeclaredAndUndeclaredJumpsOfSources) {
  Problem undeclared = Scalar(-1, 0, 1, 2);
  undeclared.f = TimeFunction::Formulas({"1.5*(t<0.7)-2"});
  Problem declared = undeclared;
  declared.break_points = {0.7};
  for (const Problem& problem : {declared, undeclared}) {
    const Solution solution = SolveAt(problem, 1e-9, {0.5, 0.75, 1, 2});
    ASSERT_EQ(solution.termination, Termination::kReachedEnd);
    for (Index k = 0; k < 4; ++k) {
      EXPECT_NEAR(solution.x(0, k), JumpExact(solution.times[k])[0], 1e-9);
    }
    ASSERT_EQ(SwitchesOf(solution).size(), 1u);
  }
  EXPECT_LT(SolveAt(declared, 1e-9).cost.steps, 12);
}

// x' = 3 (gate - x), y = 0: a gate that is open for a quarter of its period, shifted by whole periods.
TEST(EventDrivenTest, GatesMayBeShiftedByWholePeriods) {
  double exact = 0;
  for (int period = 0; period < 10; ++period) exact = (1 + (exact - 1) * std::exp(-3 * 0.025)) * std::exp(-3 * 0.075);
  for (const char* phase : {"t/0.1", "(t-0.1)/0.1", "(t+0.1)/0.1", "(t-1)/0.1", "(t+2)/0.1"}) {
    const std::string gate = std::string("3*(") + phase + "-floor(" + phase + ")<0.25)";
    for (const double size : {1.0, 1e-4}) {
      Problem problem = Scalar(-3, 0, 0, 1);
      problem.f = TimeFunction::Formulas({std::to_string(size) + "*" + gate});
      problem.g = TimeFunction::Formulas({gate});
      const Solution solution = SolveAt(problem, 1e-6);
      EXPECT_NEAR(LastState(solution)[0] / size, exact, 1e-13) << gate;
      EXPECT_LT(solution.accuracy.error, 1e-12) << gate;
    }
  }
}

TEST(EventDrivenTest, SamplesAreStraightBetweenTheirTimes) {
  Problem problem = Scalar(0, 1, 0, 1);  // y = 0
  problem.f = TimeFunction::Sampled({0, 0.3, 1}, Matrix{{0, 3, 0}});
  const Solution solution = SolveAt(problem, 1e-12, {0.3, 1});
  EXPECT_NEAR(solution.x(0, 0), 0.45, 1e-14);
  EXPECT_NEAR(solution.x(0, 1), 1.5, 1e-14);
  EXPECT_LE(solution.cost.steps, 4);
}

// x stays 0, w = g(t) + y: y = max(0, -g).
Solution SolveForGuard(const char* g) {
  Problem problem = Scalar(0, 0, 0, 2);
  problem.B.MutableDense().setZero();
  problem.g = TimeFunction::Formulas({g});
  return SolveAt(problem, 1e-9);
}

TEST(EventDrivenTest, GrazingIsNoEventAndDippingIsTwo) {
  EXPECT_TRUE(SwitchesOf(SolveForGuard("(t-1)**2")).empty());
  const std::vector<double> times = SwitchesOf(SolveForGuard("(t-1)**2-1e-6"));
  ASSERT_EQ(times.size(), 2u);
  EXPECT_NEAR(times[0], 0.999, 1e-9);
  EXPECT_NEAR(times[1], 1.001, 1e-9);
}

TEST(EventDrivenTest, PassesInflectionsAndIdenticalZeros) {
  const Solution inflection = SolveForGuard("(t-1)**3");
  ASSERT_EQ(SwitchesOf(inflection).size(), 1u);
  EXPECT_NEAR(SwitchesOf(inflection)[0], 1, 1e-3);  // y is below 1e-9 from there on
  EXPECT_TRUE(SwitchesOf(SolveForGuard("0")).empty());
}

// Point queue with sin: free and empty stretches alternate; x' = sin 20t - 1/2, x >= 0.
TEST(EventDrivenTest, JumpsOntoTheConstraintsAndSlidesThere) {
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = problem.N = Matrix(Matrix::Ones(1, 1));
  problem.M = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Formulas({"sin(20*t)-0.5"});
  problem.g = TimeFunction::Zero(1);
  problem.x0 = Vector::Constant(1, -0.5);
  problem.horizon = 3;
  const Solution solution = SolveAt(problem, 1e-10);
  ASSERT_EQ(solution.jumps.size(), 1u);
  EXPECT_DOUBLE_EQ(solution.jumps[0].dx[0], 0.5);
  const std::vector<double> times = SwitchesOf(solution);
  ASSERT_EQ(times.size(), 19u);
  for (std::size_t k = 0; k < times.size(); k += 2) {  // free from where sin 20t = 1/2, rising
    const double expected = (std::numbers::pi / 6 + 2 * std::numbers::pi * static_cast<double>(k / 2)) / 20;
    EXPECT_NEAR(times[k], expected, 1e-10);
  }
}

// Errors grow by e^10, and beside sin(40 t) there are many steps: a first solve for all of the default error would be
// followed by another one.
TEST(EventDrivenTest, SolvesOnceByDefaultWhereErrorsGrow) {
  Problem problem = Scalar(10, 10, 0, 1);
  problem.f = TimeFunction::Formulas({"40*cos(40*t) - 10*sin(40*t)"});
  const Solution solution = testing::SolveForEnd(problem);
  EXPECT_EQ(solution.method, Method::kEventDriven);
  EXPECT_EQ(solution.cost.solves, 1);
  EXPECT_NEAR(LastState(solution)[0], std::sin(40), 1e-6);
}

// An error of all of a component asks for no more than steps of 10 %.
TEST(EventDrivenTest, NoStepIsWorseThanATenth) {
  Problem problem = Scalar(-1, 100, 1, 3);
  problem.f = TimeFunction::Formulas({"40*sin(40*t)"});
  EXPECT_EQ(LastState(SolveAt(problem, 0.9)), LastState(SolveAt(problem, 0.1)));
}

// 12 million oscillations a unit of time, in 0.0025 of it: 10,000 steps that hardly advance are no reason to give up.
TEST(EventDrivenTest, PassesManyShortSteps) {
  Problem problem = Scalar(-1, 10, 1, 1);
  problem.f = TimeFunction::Formulas({"sin(2*pi*12e6*t)*(t < 0.0025)"});
  const Solution solution = SolveAt(problem, 1e-4);
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_GT(solution.cost.steps, 9000);
  EXPECT_NEAR(LastState(solution)[0], std::exp(-1), 1e-7);
}

// y = max(0, -sin(w t)) for 200 periods of 4e-6 T: such modes are short, and do not accumulate.
TEST(EventDrivenTest, PassesManyShortModes) {
  Problem problem = Scalar(0, 0, 0, 1);
  problem.N = Matrix::Zero(1, 1);
  problem.g = TimeFunction::Formulas({"sin(pi*5e5*t)*(t < 8e-4) + (t >= 8e-4)"});
  const Solution solution = SolveAt(problem, 1e-6);
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_EQ(solution.cost.coupled_steps, 0);
  EXPECT_GE(SwitchesOf(solution).size(), 399u);
  EXPECT_NEAR(LastState(solution)[0], 8e-4 / std::numbers::pi, 1e-6 * 8e-4);
}

// λ = -1e6: x follows cos 3t to 1e-6 while w > 0. Steps follow the slow solution.
TEST(EventDrivenTest, TakesLongStepsOnStiffModes) {
  Problem problem = Scalar(-1e6, 2, 1, 2);
  problem.f = TimeFunction::Formulas({"1e6*cos(3*t)-3*sin(3*t)"});
  const Solution solution = SolveAt(problem, 1e-9, {0.5, 1, 2});
  for (Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(solution.x(0, k), std::cos(3 * solution.times[k]), 1e-9);
  }
  EXPECT_LT(solution.cost.steps, 60);
}

TEST(EventDrivenTest, OutputHoldsTheNodesAskedForAndTheBitsDoNotDependOnThem) {
  const Solution few = SolveAt(ExampleFourOne(), 1e-9, {0.5});
  ASSERT_EQ(few.times, (std::vector<double>{0.5}));
  Options options;
  options.method = Method::kEventDriven;
  options.num_steps = 100;
  Observer silent;
  const auto many = Solve(ExampleFourOne(), options, silent, {});
  ASSERT_TRUE(many.ok());
  ASSERT_EQ(many->times.size(), 101u);
  EXPECT_EQ(many->times[50], 0.5);
  EXPECT_EQ(few.x.col(0), many->x.col(50));
  EXPECT_EQ(few.cost.steps, many->cost.steps);
}

TEST(EventDrivenTest, NamesWhatEntersAndLeaves) {
  Problem problem = Scalar(0, 0, 0, 2);  // w = g + y
  problem.B.MutableDense().setZero();
  problem.g = TimeFunction::Formulas({"(t-0.5)*(1.5-t)*(1-4*(t>=1))"});  // y > 0 on (0, 0.5) and on (1, 1.5)
  problem.break_points = {1};
  const std::vector<SwitchingTime> times = SolveAt(problem, 1e-9).switching_times;
  ASSERT_EQ(times.size(), 4u);
  const std::vector<Index> none, first = {0};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(times[k].time, 0.5 * static_cast<double>(k), 1e-9);
    EXPECT_EQ(times[k].entering, k % 2 ? none : first);
    EXPECT_EQ(times[k].leaving, k % 2 ? first : none);
  }
  EXPECT_EQ(times[0].kind, SwitchingKind::kStart);
  EXPECT_EQ(times[1].kind, SwitchingKind::kSwitch);
  EXPECT_EQ(times[2].kind, SwitchingKind::kBreakPoint);
}

// M = 0: x may only rise, and follows a spike of g to its top. g is so steep there that its values left and right of a
// break point differ by what the rounding of the time makes of it.
TEST(EventDrivenTest, TakesASteepKinkForNoJump) {
  Problem problem = Scalar(0, 0, 0, 2);
  problem.M = Matrix::Zero(1, 1);
  problem.g = TimeFunction::Formulas({"-max(0, 1 - abs(t - 1.5)/1e-5)"});
  Options options;
  options.method = Method::kEventDriven;
  options.output_times = {1, 1.6, 2};
  options.output_times_only = true;
  Observer silent;
  const auto solution = Solve(problem, options, silent, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  ASSERT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
  ASSERT_EQ(solution->x.cols(), 3);
  EXPECT_NEAR(solution->x(0, 0), 0, 1e-12);
  EXPECT_NEAR(solution->x(0, 1), 1, 1e-9);
  EXPECT_NEAR(solution->x(0, 2), 1, 1e-9);
  // A small jump is one all the same.
  problem.g = TimeFunction::Formulas({"-1e-6 * (t >= 1.5)"});
  const auto jumps = Solve(problem, options, silent, {});
  ASSERT_TRUE(jumps.ok()) << jumps.status();
  EXPECT_EQ(jumps->termination, Termination::kInconsistentState) << jumps->message;
}

// A fast state follows y, whose slope jumps at an event. So it starts the next step off its equilibrium by 1e-9, a
// layer that must not take smooth parts of the same degree with it.
TEST(EventDrivenTest, LayersLeaveSmoothPartsAlone) {
  constexpr double kRate = 1e9;
  Problem problem;
  problem.A = Matrix{{-kRate}};
  problem.B = Matrix{{kRate}};
  problem.N = Matrix{{0.0}};
  problem.M = Matrix{{1.0}};
  problem.f = TimeFunction::Formulas({"1e9*cos(t)"});
  problem.g = TimeFunction::Formulas({"sin(2*t)"});
  problem.x0 = Vector{{1.0}};
  problem.horizon = 6;
  std::vector<double> times;
  for (int k = 1; k <= 60; ++k) times.push_back(0.1 * k);
  const Solution solution = SolveAt(problem, 1e-10, times);
  for (Index k = 0; k < solution.x.cols(); ++k) {
    const double t = solution.times[static_cast<std::size_t>(k)];
    if (t == 0) continue;
    // A source of the frequency ω is delayed by 1/rate, to (ω/rate)².
    const double delayed = t - 1 / kRate;
    const double expected = std::cos(delayed) + std::max(0.0, -std::sin(2 * delayed));
    EXPECT_NEAR(solution.x(0, k), expected, 3 * 1e-13 + 3 * solution.accuracy.error) << t;
    EXPECT_NEAR(solution.x(0, k), expected, 1e-11) << t;
  }
}

// A SEPIC converter whose switch and diode both block for a part of each period: the currents of its inductors are
// equal there, and the voltages of switch and diode follow from their slopes, between components of 1e10 that cancel.
TEST(EventDrivenTest, KnowsTheVoltagesOfADiscontinuousMode) {
  Problem problem;
  problem.A =
      Matrix{{-200, -1e4, 200, -1e4}, {1e5, 0, 0, 0}, {200, 0, -200, 1e4}, {1e9 / 47e3, 0, -1e9 / 47e3, -2e5 / 141}};
  problem.B = Matrix{{0, 200, 1e4}, {0, -1e5, 0}, {0, -200, -1e4}, {0, -1e9 / 47e3, 0}};
  problem.N = Matrix{{0, 0, 0, 0}, {-0.02, -1, 0.02, -1}, {1, 0, -1, 0}};
  problem.M = Matrix{{0, -1, 0}, {1, 0.04, 1}, {0, -1, 0}};
  const std::string gate = "(t >= 5e-9)*((t - 5e-9) - 1e-5*floor((t - 5e-9)/1e-5) < 5.5e-6)";
  problem.f = TimeFunction::Formulas({"1", gate});
  problem.f.lift = Matrix{{115e3, -34e4}, {0, 17e7}, {5e3, 34e4}, {0, 17e11 / 47e3}};
  problem.g = TimeFunction::Formulas({"1", gate});
  problem.g.lift = Matrix{{0, 3400}, {-0.5, -68}, {0, 1700}};
  problem.x0 = Vector{{0, 12, 0, 0}};
  problem.horizon = 4e-4;
  Options options;
  options.output_times = {3.79e-4, problem.horizon};
  options.output_times_only = true;
  const Solution solution = testing::SolveToEnd(problem, options);
  EXPECT_EQ(solution.method, Method::kEventDriven);
  EXPECT_LE(solution.certificate.node_residual, 1e-10 * solution.certificate.lcp_scale);
  const auto x = solution.x.col(0), y = solution.y.col(0);
  const double of_diode = x[3] + x[1] / 2 - 5.5;  // where x1' = x3'
  EXPECT_NEAR(y[2], of_diode, 1e-8 * of_diode);
  EXPECT_NEAR(y[0], x[1] + x[3] + 0.5 - of_diode, 1e-8 * of_diode);
}

}  // namespace
}  // namespace dlcs
