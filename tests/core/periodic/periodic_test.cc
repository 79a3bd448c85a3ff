// SPDX-License-Identifier: Apache-2.0
// Periodic steady states, judged by closed forms, and by following the solution for many periods.

#include "core/periodic/periodic.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <tuple>
#include <unsupported/Eigen/MatrixFunctions>

#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/problem/verdict.h"
#include "core/problem/violation_list.h"
#include "core/solve.h"

namespace dlcs {
namespace {

constexpr double kPi = std::numbers::pi;

Problem System(Matrix A, Matrix B, Matrix N, Matrix M, TimeFunction f, TimeFunction g, Vector x0, double horizon) {
  Problem problem;
  problem.A = std::move(A);
  problem.B = std::move(B);
  problem.N = std::move(N);
  problem.M = std::move(M);
  problem.f = std::move(f);
  problem.g = std::move(g);
  problem.x0 = std::move(x0);
  problem.horizon = horizon;
  return problem;
}

// A system without complementarity: y = 0.
Problem Linear(Matrix A, TimeFunction f, Vector x0, double horizon = 10) {
  const Index m = A.rows();
  return System(std::move(A), Matrix::Zero(m, 1), Matrix::Zero(1, m), Matrix::Identity(1, 1), std::move(f),
                TimeFunction::Constant(Vector::Ones(1)), std::move(x0), horizon);
}

absl::StatusOr<Solution> Ask(const Problem& problem, double period, double tolerance = 1e-9, bool project = false) {
  Options options;
  options.period = period;
  options.error_tolerance = tolerance;
  options.project_initial_state = project;
  Observer silent;
  return Solve(problem, options, silent, {});
}

Solution Periodic(const Problem& problem, double period, double tolerance = 1e-9, bool project = false) {
  auto solution = Ask(problem, period, tolerance, project);
  EXPECT_TRUE(solution.ok()) << solution.status();
  return solution.ok() ? *std::move(solution) : Solution{};
}

// What was found, accurate whether it is stable or not.
Solution FoundPeriodic(const Problem& problem, double period, double tolerance = 1e-9, bool project = false) {
  Solution solution = Periodic(problem, period, tolerance, project);
  EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_LE(solution.accuracy.error, tolerance);
  EXPECT_TRUE(solution.periodic);
  if (!solution.periodic) solution.periodic.emplace();
  EXPECT_LE(solution.periodic->residual, tolerance);
  EXPECT_LE(solution.periodic->error, tolerance);
  return solution;
}

Solution SolvedPeriodic(const Problem& problem, double period, double tolerance = 1e-9, bool project = false) {
  Solution solution = FoundPeriodic(problem, period, tolerance, project);
  const Verdict verdict = JudgeSolution(solution);
  EXPECT_EQ(verdict.kind, VerdictKind::kSolved) << verdict.text;
  EXPECT_LE(solution.periodic->periods, 12);
  return solution;
}

// The state after many periods.
Vector AfterPeriods(Problem problem, double period, int count) {
  problem.horizon = count * period;
  Options options;
  options.method = Method::kEventDriven;
  options.error_tolerance = 1e-11;
  options.output_times = {problem.horizon};
  options.output_times_only = true;
  options.project_initial_state = true;
  Observer silent;
  auto solution = Solve(problem, options, silent, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return solution->x.rightCols(1);
}

std::vector<double> Sizes(const std::vector<std::complex<double>>& multipliers) {
  std::vector<double> sizes;
  for (const auto& multiplier : multipliers) sizes.push_back(std::abs(multiplier));
  return sizes;
}

TEST(PeriodicTest, ADrivenLinearSystem) {
  const double a = 0.01, omega = 3, period = 2 * kPi / omega;
  const Solution solution =
      SolvedPeriodic(Linear(Matrix{{-a}}, TimeFunction::Formulas({"1 + sin(3*t)"}), Vector{{0.0}}), period);
  const double size = 1 / a + 1;
  for (std::size_t k = 0; k < solution.times.size(); ++k) {
    const double t = solution.times[k];
    const double exact = 1 / a + (a * std::sin(omega * t) - omega * std::cos(omega * t)) / (a * a + omega * omega);
    EXPECT_NEAR(solution.x(0, static_cast<Index>(k)), exact, 1e-9 * size);
  }
  ASSERT_EQ(solution.periodic->multipliers.size(), 1u);
  EXPECT_NEAR(solution.periodic->multipliers[0].real(), std::exp(-a * period), 1e-12);
  EXPECT_NEAR(solution.periodic->mean_x[0], 1 / a, 1e-9 * size);
  EXPECT_NEAR(solution.periodic->mean_w[0], 1, 1e-12);
  EXPECT_LE(solution.periodic->periods, 4);
}

TEST(PeriodicTest, AnUnstableSolutionIsFound) {
  const double a = 0.7, omega = 3, period = 2 * kPi / omega;
  const Solution solution =
      FoundPeriodic(Linear(Matrix{{a}}, TimeFunction::Formulas({"sin(3*t)"}), Vector{{2.0}}), period);
  EXPECT_NEAR(solution.x(0, 0), -omega / (a * a + omega * omega), 1e-9);
  EXPECT_NEAR(solution.periodic->multipliers[0].real(), std::exp(a * period), 1e-10);
  EXPECT_EQ(solution.periodic->stability, Stability::kUnstable);
  EXPECT_NEAR(solution.periodic->growth, std::exp(a * period) - 1, 1e-10);
  const Verdict verdict = JudgeSolution(solution);
  EXPECT_FALSE(verdict.success);
  EXPECT_EQ(verdict.kind, VerdictKind::kErrorEstimated);
  EXPECT_EQ(verdict.text.substr(0, 59), "unstable: disturbances grow by a factor of 4.3 a period; es") << verdict.text;
  EXPECT_EQ(verdict.concerns.size(), 1u);
}

// Solutions from x0 grow by a factor of 3 in each period; the sizes that they reach make no state periodic.
TEST(PeriodicTest, WhatGrowsWithoutBoundsIsNotPeriodic) {
  const Vector b{{0.19957717351212656, 1.6462742367055316}};
  const Problem problem =
      System(Matrix{{-1, 0.6910825967195378}, {2.0105092097688644, -1}}, b, b.transpose(), Matrix{{0.1}},
             TimeFunction::Formulas({"max(0, sin(t))", "3.0345*sin(3*t) - 0.0742868"}),
             TimeFunction::Constant(Vector{{0.5}}), Vector{{0, 0}}, 2 * kPi);
  const Solution solution = Periodic(problem, 2 * kPi, 1e-7);
  EXPECT_EQ(solution.termination, Termination::kNotPeriodic) << solution.message;
  EXPECT_GT(MaxAbs(solution.x.rightCols(1) - solution.x.leftCols(1)), 0.1);
}

// y holds x at zero, so that x(0) is rounding, of which its own size says nothing.
TEST(PeriodicTest, AStateMayBeHeldAtZero) {
  const auto held = [](double a, double b, double M, const char* y) {
    const std::string of_y = std::string("*(") + y + ")";
    return System(Matrix{{a}}, Matrix{{b}}, Matrix{{b}}, Matrix{{M}},
                  TimeFunction::Formulas({std::to_string(-b) + of_y}),
                  TimeFunction::Formulas({std::to_string(-M) + of_y}), Vector{{0.0}}, 1);
  };
  for (const Problem& problem :
       {held(-1, 1, 0.01, "1 + sin(2*pi*t)"), held(-0.25, 0.5, 10, "exp(3*sin(2*pi*t + 4.84))"),
        held(-1, 1, 0.01, "max(0, sin(2*pi*t))")}) {
    const Solution solution = Periodic(problem, 1, 1e-7);
    const Verdict verdict = JudgeSolution(solution);
    EXPECT_EQ(verdict.kind, VerdictKind::kSolved) << verdict.text << " " << solution.message;
    EXPECT_LE(MaxAbs(solution.x), 1e-12);
    EXPECT_LE(solution.periodic->periods, 12);
  }
}

// The multiplier of x' = a x + sin t is e^{2πa}.
TEST(PeriodicTest, StabilityIsKnownUpToTheErrorOfTheMultipliers) {
  const auto judged = [](double a) {
    const Solution solution =
        FoundPeriodic(Linear(Matrix{{a}}, TimeFunction::Formulas({"sin(t)"}), Vector{{0.5}}), 2 * kPi, 1e-5);
    EXPECT_NEAR(solution.periodic->growth, std::expm1(2 * kPi * a), 1e-12) << a;
    return std::pair(solution.periodic->stability.value(), JudgeSolution(solution));
  };
  for (const double a : {0.3, 0.0027, 1e-6, 1e-9}) {
    const auto [stability, verdict] = judged(a);
    EXPECT_EQ(stability, Stability::kUnstable) << a;
    EXPECT_FALSE(verdict.success);
    const auto [other, success] = judged(-a);
    EXPECT_EQ(other, Stability::kStable) << a;
    EXPECT_TRUE(success.success) << success.text;
    EXPECT_EQ(success.text.find("stable"), std::string::npos) << success.text;
  }
  EXPECT_NE(judged(0.0027).second.text.find("unstable: disturbances grow by 1.7 % a period"), std::string::npos);
}

// Without losses multipliers are 1 in size; no rounding of them makes one unstable.
TEST(PeriodicTest, StabilityIsNotKnownWithoutLosses) {
  for (const double omega : {2.0, 2.5, 3.3, 7.7}) {
    for (const double loss : {0.0, -1e-9, 1e-9}) {
      const Problem problem =
          Linear(Matrix{{0, omega}, {-omega, -loss}}, TimeFunction::Formulas({"0", "cos(3*t)"}), Vector{{1, 0}});
      const Solution solution = FoundPeriodic(problem, 2 * kPi / 3, 1e-8);
      const Stability exact = loss == 0  ? Stability::kUndetermined
                              : loss > 0 ? Stability::kStable
                                         : Stability::kUnstable;
      EXPECT_EQ(solution.periodic->stability, exact) << omega << " " << loss << " " << solution.periodic->growth;
      const Verdict verdict = JudgeSolution(solution);
      EXPECT_EQ(verdict.success, loss >= 0) << verdict.text;
      EXPECT_EQ(verdict.text.find("; whether it is stable is not known") != std::string::npos, loss == 0);
    }
  }
}

// At rest one step may be as long as the period, in which disturbances oscillate often: their multipliers are those of
// the exponential, not of the step.
TEST(PeriodicTest, DisturbancesOfRestOscillate) {
  for (const double omega : {10.0, 30.0, 100.0, 1000.0}) {
    for (const double damping : {-0.1, 0.1}) {
      const Problem problem =
          Linear(Matrix{{0, omega}, {-omega, -damping}}, TimeFunction::Constant(Vector{{0, omega}}), Vector{{1, 0}});
      const Solution solution = Periodic(problem, 1);
      ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
      EXPECT_NEAR(solution.x(0, 0), 1, 1e-12);
      EXPECT_NEAR(solution.x(1, 0), 0, 1e-12);
      for (const double size : Sizes(solution.periodic->multipliers)) {
        EXPECT_NEAR(size, std::exp(-damping / 2), 1e-11) << omega;
      }
      EXPECT_EQ(solution.periodic->stability, damping > 0 ? Stability::kStable : Stability::kUnstable) << omega;
    }
  }
}

// A square wave charges a capacitor over a diode and a resistance; a load discharges it.
TEST(PeriodicTest, ARectifierOfASquareWave) {
  const double source_resistance = 0.5, load = 200, period = 0.2;
  const Problem problem =
      System(Matrix{{-1 / load}}, Matrix{{1}}, Matrix{{1}}, Matrix{{source_resistance}}, TimeFunction::Zero(1),
             TimeFunction::Formulas({"1 - 2*(t/0.2 - floor(t/0.2) < 0.5)"}), Vector{{0.0}}, 100);
  const Solution solution = SolvedPeriodic(problem, period);
  const double on = 1 / source_resistance + 1 / load, off = 1 / load, end = 1 / source_resistance / on;
  const double charged = std::exp(-on * period / 2), discharged = std::exp(-off * period / 2);
  const double exact = end * (1 - charged) * discharged / (1 - charged * discharged);
  EXPECT_NEAR(solution.x(0, 0), exact, 1e-9);
  EXPECT_NEAR(solution.periodic->multipliers[0].real(), charged * discharged, 1e-12);
  // The diode carries what the load takes.
  EXPECT_NEAR(solution.periodic->mean_y[0], solution.periodic->mean_x[0] / load, 1e-11);
}

// An ideal diode (M = 0) between a sine and a capacitor with a load: the capacitor forgets its past while it conducts.
TEST(PeriodicTest, AnIdealPeakRectifierHasTheMultiplierZero) {
  const double load = 5, omega = 2 * kPi, period = 1;
  const Problem problem = System(Matrix{{-1 / load}}, Matrix{{1}}, Matrix{{1}}, Matrix{{0}}, TimeFunction::Zero(1),
                                 TimeFunction::Formulas({"-sin(2*pi*t)"}), Vector{{0.3}}, 10);
  const Solution solution = SolvedPeriodic(problem, period);
  const double opens = (kPi - std::atan(omega * load)) / omega;
  const double exact = std::sin(omega * opens) * std::exp(-(period - opens) / load);
  EXPECT_NEAR(solution.x(0, 0), exact, 1e-9);
  EXPECT_NEAR(std::abs(solution.periodic->multipliers[0]), 0, 1e-12);
}

// A converter whose diode keeps the current of the inductor from going below zero, in which it rests in every period.
TEST(PeriodicTest, AConverterInDiscontinuousConduction) {
  const double period = 2e-5, inductance = 2e-5, capacitance = 1e-4, load = 20;
  const Problem problem =
      System(Matrix{{0, -1 / inductance}, {1 / capacitance, -1 / load / capacitance}}, Matrix{{1 / inductance}, {0}},
             Matrix{{1, 0}}, Matrix{{0}}, TimeFunction::Formulas({"12/2e-5*(t/2e-5 - floor(t/2e-5) < 0.3)", "0"}),
             TimeFunction::Zero(1), Vector{{0, 0}}, 1e-3);
  const Solution solution = SolvedPeriodic(problem, period);
  const Vector transient = AfterPeriods(problem, period, 1500);
  EXPECT_LT(std::abs(solution.x(1, 0) - transient[1]), 1e-8 * transient[1]);
  EXPECT_NEAR(solution.x(0, 0), 0, 1e-10);
  EXPECT_NEAR(std::abs(solution.periodic->multipliers[1]), 0, 1e-10);  // the current begins at zero
  // In a period the inductor has no mean voltage, the capacitor no mean current.
  const PeriodicRecord& record = *solution.periodic;
  EXPECT_NEAR(0.3 * 12 - record.mean_x[1] + record.mean_y[0], 0, 1e-8);
  EXPECT_NEAR(record.mean_x[0], record.mean_x[1] / load, 1e-9);
}

// The buck converter of the user's guide as `dlcs netlist` writes it: a switch of two valves, and a diode.
TEST(PeriodicTest, ABuckConverterWithASwitch) {
  const double period = 2e-5;
  const std::string gate = "(t >= 6e-9)*((t - 6e-9) - 2e-5*floor((t - 6e-9)/2e-5) < 1e-5)";
  TimeFunction f = TimeFunction::Formulas({"1", gate}), g = f;
  f.lift = Matrix{{-10638.297872340427, -1234042.5531914895}, {0, 0}};
  g.lift = Matrix{{0, 11600}, {-24.5, -116}, {0, 5800}};
  const Problem problem =
      System(Matrix{{-212.76595744680853, -21276.595744680853}, {1e4, -1e3}},
             Matrix{{0, 212.76595744680853, 21276.595744680853}, {0, 0, 0}}, Matrix{{0, 0}, {-0.01, 0}, {1, 0}},
             Matrix{{0, -1, 0}, {1, 0.02, 1}, {0, -1, 0}}, std::move(f), std::move(g), Vector{{0, 0}}, 4e-4);
  const Solution solution = SolvedPeriodic(problem, period);
  const Vector transient = AfterPeriods(problem, period, 1000);
  EXPECT_NEAR(solution.x(1, 0), transient[1], 1e-9 * transient[1]);
  EXPECT_NEAR(solution.periodic->mean_x[0], solution.periodic->mean_x[1] / 10, 1e-9);  // into 10 ohms
  const auto refused = Ask(problem, 3e-5);
  EXPECT_NE(refused.status().message().find("that of f[0] is 2e-05"), std::string::npos) << refused.status();
}

TEST(PeriodicTest, AStiffSystem) {
  const double period = 1;
  const Problem problem = System(Matrix{{-1e7, 1e7}, {0, -0.01}}, Matrix{{0}, {1}}, Matrix{{1, 0}}, Matrix{{1e-3}},
                                 TimeFunction::Zero(2), TimeFunction::Formulas({"-sin(2*pi*t)"}), Vector{{0, 0}}, 10);
  const Solution solution = SolvedPeriodic(problem, period, 1e-8);
  const Vector transient = AfterPeriods(problem, period, 30);
  EXPECT_LT(MaxAbs(solution.x.col(0) - transient), 1e-7);
}

// x jumps to 1 at a quarter of every period, and is held there up to the half.
TEST(PeriodicTest, StatesMayJumpInEveryPeriod) {
  const Problem problem =
      System(Matrix{{-1}}, Matrix{{1}}, Matrix{{1}}, Matrix{{0}}, TimeFunction::Zero(1),
             TimeFunction::Formulas({"-(t - floor(t) >= 0.25)*(t - floor(t) < 0.5)"}), Vector{{0.0}}, 5);
  const Solution solution = SolvedPeriodic(problem, 1, 1e-9, /*project=*/true);
  EXPECT_NEAR(solution.x(0, 0), std::exp(-0.5), 1e-9);
  EXPECT_EQ(solution.jumps.size(), 1u);
  EXPECT_NEAR(std::abs(solution.periodic->multipliers[0]), 0, 1e-12);
  const Solution refused = Periodic(problem, 1);
  EXPECT_EQ(refused.termination, Termination::kInconsistentState) << refused.message;
  EXPECT_EQ(refused.failure_time, 0.25);
}

TEST(PeriodicTest, DelayedSourcesArePeriodicLater) {
  const Problem problem = Linear(Matrix{{-0.1}}, TimeFunction::Formulas({"(t >= 1.5)*sin(2*pi*t)"}), Vector{{0.0}});
  const Solution solution = SolvedPeriodic(problem, 1);
  const double omega = 2 * kPi;
  EXPECT_EQ(solution.periodic->phase, 2);
  EXPECT_NEAR(solution.x(0, 0), -omega / (0.01 + omega * omega), 1e-9);
}

TEST(PeriodicTest, AResidualBelowTheToleranceIsNotEnough) {
  // From 0 the state moves by 1e-7 of what it comes to in a period.
  const Problem problem = Linear(Matrix{{-1e-7}}, TimeFunction::Formulas({"1 + sin(2*pi*t)"}), Vector{{0.0}});
  const Solution solution = SolvedPeriodic(problem, 1, 1e-6);
  EXPECT_NEAR(solution.periodic->mean_x[0], 1e7, 10);
  EXPECT_LE(solution.periodic->periods, 4);
}

TEST(PeriodicTest, WithoutLossesItIsNotIsolated) {
  const Matrix circuit{{0, 1}, {-4, 0}};  // period π
  const Solution family = Periodic(Linear(circuit, TimeFunction::Zero(2), Vector{{1, 0}}), kPi);
  EXPECT_EQ(family.termination, Termination::kNotPeriodic);
  EXPECT_NE(family.message.find("not isolated"), std::string::npos) << family.message;
  const Solution found = Periodic(Linear(circuit, TimeFunction::Zero(2), Vector{{1, 0}}), Options::kFindPeriod);
  EXPECT_EQ(found.termination, Termination::kNotPeriodic);
  EXPECT_NE(found.message.find("not isolated"), std::string::npos) << found.message;
  // Driven beside its resonance it has one periodic solution, and in resonance none.
  const Solution beside =
      SolvedPeriodic(Linear(circuit, TimeFunction::Formulas({"0", "cos(3*t)"}), Vector{{1, 0}}), 2 * kPi / 3);
  EXPECT_NEAR(beside.x(0, 0), -0.2, 1e-9);
  EXPECT_NEAR(Sizes(beside.periodic->multipliers)[0], 1, 1e-9);
  EXPECT_EQ(beside.periodic->stability, Stability::kUndetermined);
  const Solution resonance = Periodic(Linear(circuit, TimeFunction::Formulas({"0", "cos(2*t)"}), Vector{{1, 0}}), kPi);
  EXPECT_EQ(resonance.termination, Termination::kNotPeriodic);
  EXPECT_NE(resonance.message.find("grows"), std::string::npos) << resonance.message;
}

// Where hardly anything of a disturbance decays in a period, rounding would decide where the solution is.
TEST(PeriodicTest, WithHardlyAnyLossesItIsNotIsolated) {
  const auto with_loss = [](double a_period) {
    const Matrix A{{-a_period / 2 / kPi}};
    return Periodic(Linear(A, TimeFunction::Formulas({"sin(t)"}), Vector{{-1}}), 2 * kPi, 1e-4);
  };
  const Solution none = with_loss(5e-12);
  EXPECT_EQ(none.termination, Termination::kNotPeriodic);
  EXPECT_NE(none.message.find("not isolated"), std::string::npos) << none.message;
  const Solution found = with_loss(2e-11);
  EXPECT_EQ(found.termination, Termination::kReachedEnd) << found.message;
  EXPECT_NEAR(found.x(0, 0), -1, found.accuracy.error);
  EXPECT_LE(found.accuracy.error, 0.01);
}

TEST(PeriodicTest, APeriodThatIsNoneIsRefused) {
  const auto refused = Ask(Linear(Matrix{{-1}}, TimeFunction::Formulas({"sin(2*pi*t)"}), Vector{{0.0}}), 1.5);
  ASSERT_FALSE(refused.ok());
  const std::vector<Violation> violations = ViolationsOf(refused.status());
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].field, "period");
  EXPECT_NE(violations[0].description.find("f[0] is 1"), std::string::npos) << violations[0].description;
}

// x1'' = -x1 + 0.5 x1' - 2 (the part of x1' beyond [-1, 1]): negative damping in the middle.
Problem Oscillator(Vector x0, double horizon) {
  return System(Matrix{{0, 1}, {-1, 0.5}}, Matrix{{0, 0}, {-2, 2}}, Matrix{{0, -1}, {0, 1}}, Matrix::Identity(2, 2),
                TimeFunction::Zero(2), TimeFunction::Constant(Vector::Ones(2)), std::move(x0), horizon);
}

TEST(PeriodicTest, FindsTheOscillationOfAPiecewiseLinearOscillator) {
  const Solution solution = SolvedPeriodic(Oscillator(Vector{{0.1, 0}}, 60), Options::kFindPeriod);
  const PeriodicRecord& record = *solution.periodic;
  EXPECT_EQ(solution.times.back(), record.period);
  const std::vector<double> sizes = Sizes(record.multipliers);
  EXPECT_NEAR(sizes[0], 1, 1e-8);
  EXPECT_LT(sizes[1], 0.9);
  EXPECT_EQ(record.stability, Stability::kStable);  // the multiplier 1 does not count
  EXPECT_NEAR(record.growth, sizes[1] - 1, 1e-7);
  // Many periods later it is where it began, and it is symmetric.
  Problem later = Oscillator(solution.x.col(0), 1);
  EXPECT_LT(MaxAbs(AfterPeriods(later, record.period, 40) - solution.x.col(0)), 1e-7);
  EXPECT_NEAR(record.mean_x[0], 0, 1e-8);
  EXPECT_NEAR(record.mean_y[0], record.mean_y[1], 1e-8);
}

// Backwards in time a disturbance that shrank grows by as much.
TEST(PeriodicTest, AnOscillationIsUnstableBackwardsInTime) {
  const Solution forwards = SolvedPeriodic(Oscillator(Vector{{0.1, 0}}, 60), Options::kFindPeriod);
  Problem backwards = Oscillator(forwards.x.col(0), 3 * forwards.periodic->period);
  backwards.A = -backwards.A.Dense();
  backwards.B = -backwards.B.Dense();
  const Solution solution = FoundPeriodic(backwards, Options::kFindPeriod, 1e-8);
  EXPECT_NEAR(solution.periodic->period, forwards.periodic->period, 1e-7);
  EXPECT_EQ(solution.periodic->stability, Stability::kUnstable);
  const double shrinks = Sizes(forwards.periodic->multipliers)[1];
  EXPECT_NEAR(solution.periodic->growth, 1 / shrinks - 1, 1e-6 / shrinks);
  EXPECT_FALSE(JudgeSolution(solution).success);
}

// A ball on a floor that yields, in air that brakes it: it comes to rest at -g/stiffness. Newton's method from up there
// leads to other states up there, since a period holds one contact, two, or none.
Problem Ball(double height, double stiffness, double drag) {
  return System(Matrix{{0, 1}, {0, -drag}}, Matrix{{0}, {1}}, Matrix{{1, 0}}, Matrix{{1 / stiffness}},
                TimeFunction::Constant(Vector{{0, -9.81}}), TimeFunction::Zero(1), Vector{{height, 0}}, 3);
}

TEST(PeriodicTest, ABallComesToRestWhereNewtonsMethodWanders) {
  for (const double height : {1.0, 0.3, 4.0}) {
    for (const double period : {1.0, 0.37}) {
      for (const double stiffness : {1000.0, 200.0}) {
        const double drag = 0.4;
        const Solution solution = Periodic(Ball(height, stiffness, drag), period, 1e-6);
        ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
        EXPECT_NEAR(solution.x(0, 0), -9.81 / stiffness, 1e-6 * 9.81 / stiffness);
        EXPECT_NEAR(solution.x(1, 0), 0, 1e-9);
        for (const double size : Sizes(solution.periodic->multipliers)) {
          EXPECT_NEAR(size, std::exp(-drag / 2 * period), 1e-9);
        }
        EXPECT_EQ(solution.periodic->stability, Stability::kStable);
      }
    }
  }
}

// A mass on a spring hits an elastic stop, at frequencies near its own and far from it, hardly damped: solutions of
// other periods and chaos abound, transients take hundreds of periods, and of several solutions each has its basin.
// What was found repeats, and solves from nearby show the multipliers: in the direction of a left eigenvector a
// disturbance is multiplied by one in each period.
TEST(PeriodicTest, DisturbancesDoWhatTheMultipliersSay) {
  constexpr int kPeriods = 3;
  constexpr double kDisturbance = 1e-7;
  int stable = 0, unstable = 0, none = 0;
  for (const double omega : {0.6, 1.3, 1.7, 2.1}) {
    for (const double damping : {0.1, 0.02}) {
      for (const double stiffness : {5.0, 50.0, 1000.0}) {
        for (const double gap : {0.0, 0.3}) {
          const double period = 2 * kPi / omega;
          const Problem problem =
              System(Matrix{{0, 1}, {-1, -damping}}, Matrix{{0}, {-1}}, Matrix{{-1, 0}}, Matrix{{1 / stiffness}},
                     TimeFunction::Formulas({"0", "cos(" + std::to_string(omega) + "*t)"}),
                     TimeFunction::Constant(Vector{{gap}}), Vector{{-1.5, 0.7}}, 60);
          Options options;
          options.period = period;
          options.error_tolerance = 1e-9;
          options.keep_flow = true;
          Observer silent;
          const auto solution = Solve(problem, options, silent, {});
          ASSERT_TRUE(solution.ok()) << solution.status();
          if (solution->termination != Termination::kReachedEnd) {
            ++none;
            continue;
          }
          const PeriodicRecord& record = *solution->periodic;
          ASSERT_NE(record.stability, Stability::kUndetermined);
          const bool is_stable = record.stability == Stability::kStable;
          ++(is_stable ? stable : unstable);
          EXPECT_EQ(JudgeSolution(*solution).success, is_stable);
          EXPECT_EQ(std::abs(record.multipliers[0]) < 1, is_stable);
          Problem disturbed = problem;
          const Vector start = disturbed.x0 = solution->x.col(0);
          const Vector repeated = AfterPeriods(disturbed, period, kPeriods);
          // The error of the start, and what it becomes; 1e-11 is that of the repeated periods.
          const Matrix& phi = solution->flow->derivative;
          const double grows = 1 + InfinityNorm(phi * phi * phi);
          EXPECT_LT(MaxAbs(repeated - start), (record.error + 1e-11) * MaxAbs(solution->x) * grows);
          const Eigen::EigenSolver<Matrix> left(phi.transpose());
          for (Index k = 0; k < 2; ++k) {
            const Eigen::VectorXcd direction = left.eigenvectors().col(k);
            const Vector change = kDisturbance / MaxAbs(phi) * direction.real();
            disturbed.x0 = start + change;
            const Vector moved = AfterPeriods(disturbed, period, kPeriods) - repeated;
            const std::complex<double> factor =
                (direction.transpose() * moved).value() / (direction.transpose() * change).value();
            const std::complex<double> exact = std::pow(left.eigenvalues()[k], kPeriods);
            EXPECT_LT(std::abs(factor - exact), 0.02 * std::max(1.0, std::abs(exact)))
                << omega << " " << damping << " " << stiffness << " " << gap;
          }
        }
      }
    }
  }
  EXPECT_GE(stable, 30);
  EXPECT_GE(unstable, 2);
  EXPECT_LE(none, 1);
}

// What the start is off by grows within the period, since the stop turns speed into force.
TEST(PeriodicTest, TheEndIsAsAccurateAsTheStart) {
  for (const auto& [damping, force, omega] : {std::tuple{0.3, 0.3, 3.5}, std::tuple{0.05, 1.0, 2.8}}) {
    const Problem problem =
        System(Matrix{{0, 1}, {-1, -damping}}, Matrix{{0}, {1}}, Matrix{{1, 0}}, Matrix{{0.01}},
               TimeFunction::Formulas({"0", FormatNumber(force) + "*cos(" + FormatNumber(omega) + "*t)"}),
               TimeFunction::Constant(Vector{{-0.3}}), Vector{{0.5, 0}}, 200);
    const double period = 2 * kPi / omega;
    const Solution exact = FoundPeriodic(problem, period, 1e-11);
    for (const double tolerance : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
      const Solution solution = FoundPeriodic(problem, period, tolerance);
      const Vector sizes = RowMaxAbs(exact.x);
      for (const Index column : {Index{0}, exact.x.cols() - 1}) {
        const Vector error = (solution.x.col(column ? solution.x.cols() - 1 : 0) - exact.x.col(column)).cwiseAbs();
        EXPECT_LT(error.cwiseQuotient(sizes).maxCoeff(), tolerance) << omega << " " << tolerance;
      }
    }
  }
}

// A force in a potential with two wells: x'' = -d x' + x - 2 (the part of x beyond [-1, 1]) + F cos 2πt: near -2 and 2
// the system is linear, with x = ±2 + F Re(e^{iωt} / (1 - ω² + i d ω)).
TEST(PeriodicTest, OfTwoWellsOneIsFoundOrTheRidgeBetweenThem) {
  const double damping = 0.05, force = 3, omega = 2 * kPi;
  for (const double start : {-2.5, -0.2, 0.1, 0.4, 1.3, 2.6, 4.0, -4.0}) {
    const Problem problem = System(Matrix{{0, 1}, {1, -damping}}, Matrix{{0, 0}, {-2, 2}}, Matrix{{-1, 0}, {1, 0}},
                                   Matrix::Identity(2, 2), TimeFunction::Formulas({"0", "3*cos(2*pi*t)"}),
                                   TimeFunction::Constant(Vector::Ones(2)), Vector{{start, 0}}, 100);
    const Solution solution = FoundPeriodic(problem, 1, 1e-7);
    const std::complex<double> swing = force / std::complex<double>(1 - omega * omega, damping * omega);
    const double well = solution.x(0, 0) > 0 ? 2 : -2;
    if (solution.periodic->stability == Stability::kStable) {
      EXPECT_NEAR(solution.x(0, 0), well + swing.real(), 1e-6) << start;
      EXPECT_NEAR(solution.x(1, 0), -omega * swing.imag(), 1e-6) << start;
    } else {
      // Between the wells, x'' = -d x' + x + F cos ωt.
      EXPECT_EQ(solution.periodic->stability, Stability::kUnstable);
      EXPECT_NEAR(solution.x(0, 0), (force / std::complex<double>(-1 - omega * omega, damping * omega)).real(), 1e-6);
    }
  }
}

// u = -sgn(x1 + x2 + x3) for the sum of three first-order systems: Tsypkin's condition gives half the period.
TEST(PeriodicTest, FindsTheOscillationOfARelay) {
  // 1/((s+1)(s+2)(s+3)) in parts: residues 1/2, -1, 1/2.
  const Vector rates{{1, 2, 3}}, residues{{0.5, -1, 0.5}};
  // c (I + e^{Ah})⁻¹ ∫ e^{As} b = Σ r_i/λ_i tanh(λ_i h/2) vanishes.
  const auto condition = [&](double h) {
    double sum = 0;
    for (Index i = 0; i < 3; ++i) sum += residues[i] / rates[i] * std::tanh(rates[i] * h / 2);
    return sum;
  };
  double low = 0.1, high = 10;
  ASSERT_LT(condition(low) * condition(high), 0);
  for (int k = 0; k < 200; ++k) {
    const double middle = (low + high) / 2;
    (condition(middle) * condition(low) > 0 ? low : high) = middle;
  }
  // s = c x; y1 = 1 + u, y2 = max(0, -s): w1 = s + y2, w2 = 2 - y1.
  Matrix B = Matrix::Zero(3, 2);
  B.col(0) = residues;
  Matrix N = Matrix::Zero(2, 3);
  N.row(0).setOnes();
  const Problem problem =
      System(-Matrix(rates.asDiagonal()), B, N, Matrix{{0, 1}, {-1, 0}}, TimeFunction::Constant(-residues),
             TimeFunction::Constant(Vector{{0, 2}}), Vector{{0.3, -0.1, 0.2}}, 60);
  const Solution solution = SolvedPeriodic(problem, Options::kFindPeriod, 1e-8);
  EXPECT_NEAR(solution.periodic->period, 2 * low, 1e-7);
  EXPECT_NEAR(Sizes(solution.periodic->multipliers)[0], 1, 1e-7);
}

// x' = u - x, and u = 1 changes to -1 where x rises above 1/2, and back below -1/2. After half an oscillation x is
// where it was, but u is not.
TEST(PeriodicTest, AHysteresisReturnsToItsBranch) {
  const double half = std::log(3.0);
  Problem problem =
      System(Matrix{{-1}}, Matrix{{-1, 0}}, Matrix{{-1}, {0}}, Matrix{{-0.5, 1}, {-1, 0}},
             TimeFunction::Constant(Vector{{1}}), TimeFunction::Constant(Vector{{0.5, 2}}), Vector{{0}}, 20);
  problem.rule = SolutionRule::kHistory;
  problem.y0 = Vector{{0, 0}};
  const Solution found = SolvedPeriodic(problem, Options::kFindPeriod);
  EXPECT_NEAR(found.periodic->period, 2 * half, 1e-8);
  EXPECT_NEAR(found.periodic->mean_x[0], 0, 1e-8);
  EXPECT_NEAR(Sizes(found.periodic->multipliers)[0], 1, 1e-8);
  for (const double period : {half, 1.1}) {
    const Solution none = Periodic(problem, period);
    EXPECT_EQ(none.termination, Termination::kNotPeriodic) << none.message;
    EXPECT_NE(none.message.find("periodic"), std::string::npos) << none.message;
  }
}

// The same comparator around a voltage that is 400,000 times its hysteresis.
TEST(PeriodicTest, ASmallRippleIsAnOscillation) {
  const double offset = 4e5;
  Problem problem = System(Matrix{{-1}}, Matrix{{-1, 0}}, Matrix{{-1}, {0}}, Matrix{{-0.5, 1}, {-1, 0}},
                           TimeFunction::Constant(Vector{{1 + offset}}),
                           TimeFunction::Constant(Vector{{0.5 + offset, 2}}), Vector{{offset}}, 20);
  problem.rule = SolutionRule::kHistory;
  problem.y0 = Vector{{0, 0}};
  const Solution found = SolvedPeriodic(problem, Options::kFindPeriod, 1e-7);
  EXPECT_NEAR(found.periodic->period, 2 * std::log(3.0), 1e-2);
}

TEST(PeriodicTest, SaysWhereThereIsNoOscillation) {
  const Solution rest =
      Periodic(Linear(Matrix{{-1, 2}, {-2, -1}}, TimeFunction::Zero(2), Vector{{1, 0}}, 100), Options::kFindPeriod);
  EXPECT_EQ(rest.termination, Termination::kNotPeriodic);
  EXPECT_NE(rest.message.find("comes to rest"), std::string::npos) << rest.message;
  const Solution decays =
      Periodic(Linear(Matrix{{-0.1, 2}, {-2, -0.1}}, TimeFunction::Zero(2), Vector{{1, 0}}, 30), Options::kFindPeriod);
  EXPECT_EQ(decays.termination, Termination::kNotPeriodic) << decays.periodic->period;
  EXPECT_NE(decays.message.find("equilibrium"), std::string::npos) << decays.message;
  const auto driven =
      Ask(Linear(Matrix{{-1}}, TimeFunction::Formulas({"sin(t)"}), Vector{{1.0}}), Options::kFindPeriod);
  EXPECT_FALSE(driven.ok());
}

}  // namespace
}  // namespace dlcs
