// SPDX-License-Identifier: Apache-2.0
// Judged by closed forms, by references made with exact exponentials, and by what is known of switching
// times.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>

#include "core/event_driven/interpolant.h"
#include "core/event_driven/rounded_data.h"
#include "core/format_number.h"
#include "core/linalg/norms.h"
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
using testing::LoadCase;
using testing::ReferenceTimes;
using testing::Scalar;

// By event location to an error, or to that which is taken where none is asked for.
Solution SolveAt(const Problem& problem, double tolerance, std::vector<double> times = {}) {
  Options options;
  options.method = Method::kEventDriven;
  options.error_tolerance = tolerance;
  options.output_times = std::move(times);
  options.output_times_only = !options.output_times.empty();
  options.keep_pieces = true;
  options.project_initial_state = true;
  Observer silent;
  auto solution = Solve(problem, options, silent, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return solution.ok() ? *std::move(solution) : Solution{};
}
constexpr double kNoTolerance = 0;

// A relay with hysteresis: x' = 1 - 2u, and u goes to 1 where x rises to 0 and to 0 where x falls to -1/2. So x is a
// triangle with a period of 1.
TEST(EventDrivenTest, ARelayKeepsItsStateWithinItsHysteresis) {
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = (Matrix(1, 2) << -2, 0).finished();
  problem.N = (Matrix(2, 1) << -1, 0).finished();
  problem.M = (Matrix(2, 2) << -0.5, 1, -1, 0).finished();
  problem.f = TimeFunction::Constant(Vector::Ones(1));
  problem.g = TimeFunction::Constant(Vector{{0, 1}});
  problem.x0 = Vector::Constant(1, -0.25);
  problem.horizon = 10;
  problem.break_points = {2.125, 6.5};
  problem.rule = SolutionRule::kHistory;
  for (const double start : {0.0, 1.0}) {
    problem.y0 = Vector{{start, start}};
    const Solution solution = SolveAt(problem, 1e-10, {1.0, 10.0});
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    for (Index k = 0; k < 2; ++k) EXPECT_NEAR(solution.x(0, k), -0.25, 1e-9);
    EXPECT_EQ(solution.y(0, 1), start);
  }
}

Vector LastState(const Solution& solution) { return solution.x.col(solution.x.cols() - 1); }

// Where the active set changes, the start left out.
std::vector<double> SwitchesOf(const Solution& solution) {
  std::vector<double> times;
  for (std::size_t k = 1; k < solution.switching_times.size(); ++k) times.push_back(solution.switching_times[k].time);
  return times;
}

// The active set at the end, as the list of switching times tells it.
std::set<Index> LastActive(const Solution& solution) {
  std::set<Index> active;
  for (const SwitchingTime& switching : solution.switching_times) {
    for (const Index i : switching.entering) EXPECT_TRUE(active.insert(i).second) << "entered twice: " << i;
    for (const Index i : switching.leaving) EXPECT_EQ(active.erase(i), 1u) << "left without having entered: " << i;
  }
  return active;
}

class EventCasesTest : public ::testing::TestWithParam<const char*> {};

// True errors, relative to the largest value, at three tolerances; and the switching times of the reference.
TEST_P(EventCasesTest, ErrorIsBelowTheTolerance) {
  const Case the_case = LoadCase(GetParam());
  for (const double tolerance : {1e-5, 1e-9, 1e-12}) {
    const Solution solution = SolveAt(the_case.problem, tolerance, ReferenceTimes(the_case));
    if (solution.termination == Termination::kIterationLimit) {
      // Where an ulp of the data may move x by more than was asked that is said, though the answer is as good.
      EXPECT_EQ(tolerance, 1e-12) << solution.message;
      EXPECT_GT(solution.accuracy.error, tolerance);
    } else {
      ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
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

// x' = x. On a long step the polynomial of the step misses its start by little against its end, and the growth of the
// whole step is wrong by as much against its start.
TEST(EventDrivenTest, FiguresHoldWhereModesGrow) {
  Problem problem;
  problem.A = Matrix{{1}};
  problem.B = problem.N = Matrix{{0}};
  problem.M = Matrix{{1}};
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector{{1}});
  problem.x0 = Vector{{1}};
  for (const double horizon : {12.0, 20.0, 30.0, 40.0, 100.0}) {
    problem.horizon = horizon;
    for (const double tolerance : {0.1, 1e-2, 1e-3, 1e-6}) {
      const Solution solution = SolveAt(problem, tolerance, {horizon});
      ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
      const double error = std::abs(solution.x(0, solution.x.cols() - 1) / std::exp(horizon) - 1);
      EXPECT_LE(error, 3 * solution.accuracy.error) << "T = " << horizon << ", tolerance " << tolerance;
    }
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

TEST(EventDrivenTest, MeasuresErrorsAgainstTheStartToo) {
  const Solution solution = SolveAt(Scalar(-1, 0, 5, 2), 1e-9);  // x = 5 e^{-t}
  EXPECT_DOUBLE_EQ(solution.certificate.x_scale, 5);
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

// k relays: x' = A x + f - C sgn(D x), sgn(0) anything in [-1, 1]; y_i = 1 - sgn_i.
Problem Relays(const Matrix& A, const Matrix& C, const Matrix& D, const Vector& x0, double horizon) {
  const Index m = A.rows();
  const Index k = D.rows();
  Problem problem;
  problem.A = A;
  problem.B = Matrix::Zero(m, 2 * k);
  problem.B.MutableDense().leftCols(k) = C;
  problem.N = Matrix::Zero(2 * k, m);
  problem.N.MutableDense().topRows(k) = D;
  problem.M = Matrix::Zero(2 * k, 2 * k);
  problem.M.MutableDense().topRightCorner(k, k).setIdentity();
  problem.M.MutableDense().bottomLeftCorner(k, k) = -Matrix::Identity(k, k);
  problem.f = TimeFunction::Constant(-C * Vector::Ones(k));
  Vector g = Vector::Zero(2 * k);
  g.tail(k).setConstant(2);
  problem.g = TimeFunction::Constant(g);
  problem.x0 = x0;
  problem.horizon = horizon;
  return problem;
}

// A put option: V_i >= max(0, K - S_i), and at first V is equal to that. Beyond the strike V and y are zero, and far
// beyond it V remains smaller than any rounding error.
TEST(EventDrivenTest, StatesThatAreNotReachedYetActivateNothing) {
  constexpr Index kSize = 60, kStrike = 20;
  Problem problem;
  Matrix A = Matrix::Zero(kSize, kSize);
  for (Index i = 0; i < kSize; ++i) {
    A(i, i) = -400.1;
    if (i > 0) A(i, i - 1) = 199;
    if (i + 1 < kSize) A(i, i + 1) = 201;
  }
  Vector payoff(kSize), f = Vector::Zero(kSize);
  for (Index i = 0; i < kSize; ++i) payoff[i] = std::max<double>(0, static_cast<double>(kStrike - i));
  f[0] = 199 * (kStrike + 1);
  problem.A = A;
  problem.B = problem.N = Matrix(Matrix::Identity(kSize, kSize));
  problem.M = Matrix(Matrix::Zero(kSize, kSize));
  problem.f = TimeFunction::Constant(f);
  problem.g = TimeFunction::Constant(-payoff);
  problem.x0 = payoff;
  problem.horizon = 1;
  for (const double tolerance : {1e-6, 1e-9}) {
    const Solution solution = SolveAt(problem, tolerance);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_EQ(solution.cost.coupled_steps, 0);
    EXPECT_LE(solution.accuracy.error, tolerance);
    ASSERT_GE(solution.switching_times.size(), 3u);
    EXPECT_EQ(solution.switching_times[0].entering.size(), static_cast<std::size_t>(kStrike));
    // The free boundary moves down, one pair after the other.
    Index last = kStrike;
    for (std::size_t k = 1; k < solution.switching_times.size(); ++k) {
      EXPECT_TRUE(solution.switching_times[k].entering.empty());
      ASSERT_EQ(solution.switching_times[k].leaving, std::vector<Index>{--last});
    }
    EXPECT_GE(solution.x.minCoeff(), -1e-25);  // rounding of states that are zero
  }
}

// |x1| + |x2| falls with slope -2, through ever more switches: zero at t = 0.65, and sliding in both behind
// it.
TEST(EventDrivenTest, FollowsSwitchesThatAccumulateIntoSliding) {
  const Matrix C{{1, -2}, {2, 1}};
  const Problem problem = Relays(Matrix::Zero(2, 2), C, Matrix::Identity(2, 2), Vector{{1, 0.3}}, 2);
  const Solution solution = SolveAt(problem, 1e-9, {0.3, 0.6, 0.649, 0.66, 2});
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  for (Index k = 0; k < 3; ++k) EXPECT_NEAR(solution.x.col(k).cwiseAbs().sum(), 1.3 - 2 * solution.times[k], 1e-12);
  EXPECT_LT(MaxAbs(solution.x.rightCols(2)), 1e-12);
  EXPECT_GT(SwitchesOf(solution).size(), 15u);
  EXPECT_NEAR(SwitchesOf(solution).back(), 0.65, 1e-9);
  EXPECT_EQ(LastActive(solution), (std::set<Index>{0, 1}));
}

// x1' = x2, x2' = -2 sgn x1 - sgn x2: switches accumulate at a point where no mode of relative degree one
// holds. The coupled march survives, and the record says so.
TEST(EventDrivenTest, SurvivesWhereNoModeLasts) {
  Matrix A = Matrix::Zero(2, 2);
  A(0, 1) = 1;
  const Problem problem = Relays(A, Matrix{{0, 0}, {2, 1}}, Matrix::Identity(2, 2), Vector{{1, 0}}, 10);
  const Solution solution = SolveAt(problem, kNoTolerance, {4, 6, 10});
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_GT(solution.cost.coupled_steps, 0);
  EXPECT_EQ(solution.switching_times.back().kind, SwitchingKind::kCoupledStepsBegin);
  EXPECT_LT(MaxAbs(solution.x.rightCols(2)), 1e-5);
  ASSERT_EQ(solution.warnings.size(), 2u);  // relays that are not passive may leave x open, too
  EXPECT_NE(solution.warnings[1].find("No active set lasted from t = "), std::string::npos) << solution.warnings[1];
  EXPECT_LE(solution.accuracy.error, solution.accuracy.tolerance);

  // Who asks for an error gets it: the steps are taken again, shorter. The state rests at zero behind the point.
  const Solution asked = SolveAt(problem, 1e-9, {4, 6, 10});
  EXPECT_EQ(asked.termination, Termination::kReachedEnd) << asked.message;
  EXPECT_LE(asked.accuracy.error, 1e-9);
  EXPECT_LT(MaxAbs(asked.x.rightCols(2)), 1e-9);
}

// The oscillation of a relay behind a double integrator: parabolas, switches √2, 3√2, 5√2, ...
TEST(EventDrivenTest, SwitchesARelayBehindTwoIntegrators) {
  Matrix A = Matrix::Zero(2, 2);
  A(0, 1) = 1;
  const Solution solution = SolveAt(Relays(A, Vector{{0, 1}}, Vector{{1, 0}}.transpose(), Vector{{1, 0}}, 20), 1e-9);
  const std::vector<double> times = SwitchesOf(solution);
  ASSERT_EQ(times.size(), 7u);
  for (std::size_t k = 0; k < times.size(); ++k) {
    EXPECT_NEAR(times[k], static_cast<double>(2 * k + 1) * std::numbers::sqrt2, 1e-12);
  }
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

// The least element of 0 <= y ⟂ x - y >= 0 is y = 0 for x >= 0, and there is none for x < 0; x = 1 - t.
TEST(EventDrivenTest, EndsWhereNoLeastElementIsLeft) {
  Problem problem = Scalar(0, 0, 1, 2);
  problem.M(0, 0) = -1;
  problem.f = TimeFunction::Constant(Vector::Constant(1, -1));
  problem.B(0, 0) = 0.5;
  const Solution solution = SolveAt(problem, 1e-9);
  EXPECT_EQ(solution.termination, Termination::kInfeasible) << solution.message;
  EXPECT_NEAR(solution.failure_time, 1, 1e-8);
  EXPECT_LT(solution.times.back(), 1);
  EXPECT_GT(solution.times.back(), 0.99);
}

TEST(EventDrivenTest, SaysWhenTheStateOverflows) {
  const Solution solution = SolveAt(Scalar(1e4, 1, 1, 10), 1e-9);
  EXPECT_EQ(solution.termination, Termination::kNonFinite) << solution.message;
  EXPECT_LT(solution.failure_time, 0.08);
}

TEST(EventDrivenTest, DoesNotCallALargeSourceInfinite) {
  Problem problem = Scalar(-1, 1, 1, 2);
  for (const char* source : {"1.7e308*cos(9*t)", "1e307*sin(40*t)"}) {
    problem.g = TimeFunction::Formulas({source});
    const Solution large = SolveAt(problem, 1e-9);
    EXPECT_EQ(large.termination, Termination::kNonFinite) << source;
    EXPECT_TRUE(large.message.starts_with("g[0] is ")) << large.message;
    EXPECT_NE(large.message.find("overflow"), std::string::npos) << large.message;
    EXPECT_EQ(large.message.find("finite"), std::string::npos) << large.message;
  }
}

TEST(EventDrivenTest, DoesNotCallGrowthBeyondTheRangeOfNumbersInfeasible) {
  // y = 1000 (x2 - x1) + 0.001 grows like e^{1000 t}, beyond 1.8e308 at t = 0.72.
  Problem problem;
  problem.A = Matrix::Zero(2, 2);
  problem.B = Matrix{{-1}, {0}};
  problem.N = Matrix{{1000, -1000}};
  problem.M = Matrix{{1}};
  problem.x0 = Vector::Zero(2);
  problem.f = TimeFunction::Constant(Vector::Zero(2));
  problem.g = TimeFunction::Constant(Vector{{-0.001}});
  problem.horizon = 1;
  const Solution solution = SolveAt(problem, 1e-9);
  EXPECT_EQ(solution.termination, Termination::kNonFinite) << solution.message;
  EXPECT_NEAR(solution.failure_time, 0.72, 0.01);
}

// x1 = x3 keep x2 at zero, to the bit; any error of x2 grows by e^1000 in a unit of time.
TEST(EventDrivenTest, AnErrorBeyondTheRangeOfNumbersIsInfinite) {
  Problem problem;
  problem.A = Matrix{{-1, 0, 0, 0}, {1, 1000, -1, 0}, {0, 0, -1, 0}, {0, 1, 0, -1}};
  problem.B = Matrix::Zero(4, 1);
  problem.N = Matrix::Zero(1, 4);
  problem.M = Matrix{{1}};
  problem.f = TimeFunction::Zero(4);
  problem.g = TimeFunction::Constant(Vector{{1}});
  problem.x0 = Vector{{1, 0, 1, 1}};
  problem.horizon = 2;
  const Solution solution = SolveAt(problem, 1e-6, {problem.horizon});
  EXPECT_EQ(solution.termination, Termination::kIterationLimit);
  EXPECT_EQ(solution.accuracy.error, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(solution.message.starts_with("The estimated error grows beyond the range of numbers"))
      << solution.message;
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

TEST(EventDrivenTest, IsDenseBetweenItsNodes) {
  const Problem problem = ExampleFourOne();
  const Solution solution = SolveAt(problem, 1e-9);
  ASSERT_EQ(static_cast<Index>(solution.pieces.size()), solution.cost.steps);
  auto dense = Interpolant::Create(problem, solution);
  ASSERT_TRUE(dense.ok()) << dense.status();
  for (const double t : {0.0, 0.1003, 0.5, 0.77777, 1.0}) {
    const Interpolant::Point point = dense->At(t);
    const Vector x = ExampleFourOneExact(t);
    EXPECT_LT(MaxAbs(point.x - x), 1e-9) << t;
    EXPECT_LT(MaxAbs(point.y - Vector{{std::max(x[0], 0.0), 0, 0, std::max(-x[0], 0.0)}}), 1e-9) << t;
  }
}

// The march too: x1' = x2, x2' = -2 sgn x1 - sgn x2 is continuous, and dense output meets the nodes from both sides.
TEST(EventDrivenTest, DenseOutputMeetsTheNodesOfCoupledSteps) {
  Matrix A = Matrix::Zero(2, 2);
  A(0, 1) = 1;
  const Problem problem = Relays(A, Matrix{{0, 0}, {2, 1}}, Matrix::Identity(2, 2), Vector{{1, 0}}, 10);
  const Solution solution = SolveAt(problem, kNoTolerance);
  ASSERT_GT(solution.cost.coupled_steps, 0);
  auto dense = Interpolant::Create(problem, solution);
  ASSERT_TRUE(dense.ok()) << dense.status();
  for (Index k = 1; k + 1 < solution.x.cols(); ++k) {
    for (const Side side : {Side::kLeft, Side::kRight}) {
      EXPECT_LT(MaxAbs(dense->Limit(solution.times[k], side).x - solution.x.col(k)), 1e-12) << solution.times[k];
    }
  }
}

TEST(EventDrivenTest, DenseOutputNeedsThePieces) {
  Options options;
  options.method = Method::kEventDriven;
  Observer silent;
  const auto solution = Solve(ExampleFourOne(), options, silent, {});
  ASSERT_TRUE(solution.ok());
  EXPECT_TRUE(solution->pieces.empty());
  EXPECT_FALSE(Interpolant::Create(ExampleFourOne(), *solution).ok());
}

// w = g + y with g = -1 before the break point at 1 and -3 behind it: y jumps from 1 to 3.
TEST(EventDrivenTest, HasBothLimitsWhereYJumps) {
  Problem problem = Scalar(0, 0, 0, 2);
  problem.B.MutableDense().setZero();
  problem.g = TimeFunction::Formulas({"-1-2*(t>=1)"});
  problem.break_points = {1};
  const Solution solution = SolveAt(problem, 1e-9);
  ASSERT_EQ(solution.left_limits.size(), 1u);
  const Index column = solution.left_limits[0].column;
  EXPECT_EQ(solution.times[column], 1);
  EXPECT_NEAR(solution.left_limits[0].y[0], 1, 1e-12);
  EXPECT_NEAR(solution.y(0, column), 3, 1e-12);
  auto dense = Interpolant::Create(problem, solution);
  ASSERT_TRUE(dense.ok()) << dense.status();
  EXPECT_NEAR(dense->Limit(1, Side::kLeft).y[0], 1, 1e-12);
  EXPECT_NEAR(dense->Limit(1, Side::kRight).y[0], 3, 1e-12);
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

TEST(EventDrivenTest, EstimatesItsError) {
  Options options;
  options.method = Method::kEventDriven;
  options.error_tolerance = 1e-6;
  Observer silent;
  const auto solution = Solve(ExampleFourOne(), options, silent, {});
  ASSERT_TRUE(solution.ok());
  const Vector x = ExampleFourOneExact(1);
  const double at_end = MaxAbs(solution->x.rightCols(1) - x) / MaxAbs(solution->x);
  EXPECT_GE(3 * solution->accuracy.error, at_end);
  EXPECT_LT(solution->accuracy.error, 1e-6);
}

TEST(EventDrivenTest, StopsOnRequest) {
  std::stop_source stop;
  stop.request_stop();
  Options options;
  options.method = Method::kEventDriven;
  Observer silent;
  const auto result = Solve(ExampleFourOne(), options, silent, stop.get_token());
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->termination, Termination::kCancelled);
}

TEST(EventDrivenTest, RefusesRulesThatAModeDoesNotDetermineAndRelativeDegreeThree) {
  Problem problem = LoadCase("diode_bridge_cap").problem;
  problem.rule = SolutionRule::kLeastNorm;
  const Solution least_norm = SolveAt(problem, 1e-9);
  EXPECT_EQ(least_norm.termination, Termination::kUnsupported);
  EXPECT_NE(least_norm.message.find("least norm"), std::string::npos) << least_norm.message;
  const Solution triple = SolveAt(LoadCase("outside_triple_integrator").problem, 1e-9);
  EXPECT_EQ(triple.termination, Termination::kUnsupported);
  EXPECT_NE(triple.message.find("relative degree 3"), std::string::npos) << triple.message;
}

TEST(EventDrivenTest, RefusesTolerancesThatDoublesCannotMeet) {
  Observer silent;
  for (const double tolerance : {-1.0, 1e-15, 1.0, std::nan("")}) {
    Options options;
    options.error_tolerance = tolerance;
    const auto result = Solve(ExampleFourOne(), options, silent, {});
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument) << tolerance;
  }
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

// What rounding of w may hide is no solution: w = x1 + g + y with terms of 2^43 is sin t + y, so that x2' = y makes
// x2(2π) = 2, and w of a small difference of states 1e12 times as large.
TEST(EventDrivenTest, CountsAsAnErrorWhatRoundingMayHide) {
  Problem large;
  large.A = Matrix{{0.0, 0.0}, {0.0, 0.0}};
  large.B = Matrix{{0.0}, {1.0}};
  large.N = Matrix{{1.0, 0.0}};
  large.M = Matrix{{1.0}};
  large.f = TimeFunction::Constant(Vector::Zero(2));
  large.g = TimeFunction::Formulas({"sin(t)-8796093022208"});
  large.x0 = Vector{{8796093022208, 0.0}};
  large.horizon = 8;
  EXPECT_GT(SolveAt(large, 1e-6).accuracy.error, 0.3);

  Problem difference;
  difference.A = Matrix{{-1.0, 0.0, 0.0}, {0.0, -1.000000000001, 0.0}, {0.0, 0.0, -1.0}};
  difference.B = Matrix{{0.0}, {0.0}, {1.0}};
  difference.N = Matrix{{-1e12, 1e12, 0.0}};
  difference.M = Matrix{{1.0}};
  difference.f = TimeFunction::Formulas({"sin(5*t)", "sin(5*t)", "0"});
  difference.g = TimeFunction::Constant(Vector::Zero(1));
  difference.x0 = Vector{{0.0, 0.0, 0.0}};
  difference.horizon = 5;
  EXPECT_GT(SolveAt(difference, 1e-6).accuracy.error, 0.3);
}

// Starts where y = w = 0, and y drives w down (N B < 0) with the rate 1/M: x = t², y = sin³t, from which whatever
// rounding does to w moves away like e^{t/M}. Where w leaves zero at once rounding decides nothing.
TEST(EventDrivenTest, CountsASolutionThatRoundingDecides) {
  Problem problem = Scalar(0, 0, 0, 1);
  problem.B = -Matrix::Ones(1, 1);
  problem.M = Matrix::Constant(1, 1, 1e-4);
  problem.f = TimeFunction::Formulas({"2*t + sin(t)**3"});
  problem.g = TimeFunction::Formulas({"-t*t - 1e-4*sin(t)**3"});
  EXPECT_GT(SolveAt(problem, kNoTolerance).accuracy.error, 0.3);
  problem.f = TimeFunction::Constant(Vector::Ones(1));
  problem.g = TimeFunction::Zero(1);
  const Solution leaves = SolveAt(problem, kNoTolerance);
  EXPECT_NEAR(leaves.x(0, leaves.x.cols() - 1), 1, 1e-14);
  EXPECT_LT(leaves.accuracy.error, 1e-9);
}

// w = x1 = 1 + cos t - d falls below zero by d at t = π, where y holds it: x1 is d larger from there on, and x2, that
// nothing else moves, is 1e10 d.
// x' = 1 + v with v in Sgn(x), and scaled by powers of two: a relay that drives x away from 0. From 0 there are
// solutions on both sides; from every other x0 one of them, on its side.
TEST(EventDrivenTest, ARepellingRelayFollowsTheSignOfItsStart) {
  for (const int unit : {0, -30, 30}) {
    Problem problem;
    problem.A = Matrix::Zero(1, 1);
    problem.B = std::ldexp(1.0, unit) * (Matrix(1, 2) << -1, 0).finished();
    problem.N = std::ldexp(1.0, -unit) * (Matrix(2, 1) << 1, 0).finished();
    problem.M = (Matrix(2, 2) << 0, 1, -1, 0).finished();
    problem.f = TimeFunction::Constant(Vector::Constant(1, std::ldexp(1.0, unit)));
    problem.g = TimeFunction::Constant(Vector{{0, 2}});
    problem.horizon = 3;
    for (const double distance : {1.0, 1e-6, 1e-9, 1e-11, 1e-12, 1e-13, 1e-15, 1e-17, 1e-40}) {
      for (const double sign : {-1.0, 1.0}) {
        problem.x0 = Vector::Constant(1, std::ldexp(sign * distance, unit));
        const Solution solution = SolveAt(problem, kNoTolerance);
        ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
        EXPECT_NEAR(std::ldexp(LastState(solution)[0], -unit), sign * (3 + distance), 1e-9) << sign * distance;
      }
    }
  }
}

// x1 = 1e6 cos 10t drives x2 = small sin 5t, whose terms of 5e7 cancel but for rounding: the figure counts what that is
// of x2, also where x2 is no larger than the bound of its rounding.
TEST(EventDrivenTest, CountsRoundingInWhatIsLeftOfLargeTerms) {
  Problem problem;
  problem.A = Matrix{{-100, 0}, {-50, -0.01}};
  problem.B = Matrix::Zero(2, 1);
  problem.N = Matrix::Zero(1, 2);
  problem.M = Matrix{{1}};
  problem.g = TimeFunction::Constant(Vector{{1}});
  problem.x0 = Vector{{1e6, 0}};
  problem.horizon = 3;
  for (const double small : {1e-2, 1e-4, 1e-5, 2e-6, 1e-6}) {
    const std::string size = FormatNumber(small);
    problem.f = TimeFunction::Formulas(
        {"-1e7*sin(10*t)+100.0*1e6*cos(10*t)", "5e7*cos(10*t)+" + size + "*(5*cos(5*t)+0.01*sin(5*t))"});
    const Solution solution = SolveAt(problem, kNoTolerance);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    double error = 0;
    for (Index k = 0; k < solution.x.cols(); ++k) {
      error = std::max(error, std::abs(solution.x(1, k) / small - std::sin(5 * solution.times[k])));
    }
    EXPECT_GT(error, 1e-8) << size;  // it is rounding
    EXPECT_GE(solution.accuracy.error, error) << size;
  }
}

// Of numbers that are sums themselves, such as 0.1 + 0.2 - 0.3, the sign is rounding: a relay that attracts x holds it
// at 0 from there, at once.
TEST(EventDrivenTest, AStartThatIsRoundingRests) {
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = (Matrix(1, 2) << 2, 0).finished();
  problem.N = (Matrix(2, 1) << 1, 0).finished();
  problem.M = (Matrix(2, 2) << 0, 1, -1, 0).finished();
  problem.f = TimeFunction::Constant(Vector::Constant(1, -2));
  problem.g = TimeFunction::Constant(Vector{{0, 2}});
  problem.horizon = 3;
  for (const double start : {0.1 + 0.2 - 0.3, -(0.1 + 0.2 - 0.3), 0.0}) {
    problem.x0 = Vector::Constant(1, start);
    const Solution solution = SolveAt(problem, kNoTolerance);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_NEAR(LastState(solution)[0], 0, 1e-15) << start;
  }
}

TEST(EventDrivenTest, FindsShallowContactsOrCountsThem) {
  constexpr double kGain = 1e10;
  for (const double depth : {1e-6, 1e-8, 1e-9, 1e-10, 1e-11}) {
    for (const double tolerance : {1e-4, 1e-6, 1e-9}) {
      Problem problem;
      problem.A = Matrix{{0.0, 0.0}, {0.0, 0.0}};
      problem.B = Matrix{{1.0}, {kGain}};
      problem.N = Matrix{{1.0, 0.0}};
      problem.M = Matrix{{0.0}};
      problem.f = TimeFunction::Formulas({"-sin(t)", "0"});
      problem.g = TimeFunction::Constant(Vector::Zero(1));
      problem.x0 = Vector{{2 - depth, 0.0}};
      problem.horizon = 8;
      const Solution solution = SolveAt(problem, tolerance);
      const double expected = kGain * (2 - problem.x0[0]);
      const double error = std::abs(LastState(solution)[1] - expected) / expected;
      EXPECT_LE(error, 3 * solution.accuracy.error) << "depth " << depth << ", tolerance " << tolerance;
    }
  }
}

// x' = A x, whose modes are fast, growing and slow. An ulp of A moves the part that grows by some 1e7 ulps in a unit of
// time. The rounding errors of the rows have the ratios of the fast mode. Two rows alone reach the part that grows: for
// one of both choices of their signs the errors cancel.
TEST(EventDrivenTest, CountsUlpsOfTheDataWhateverTheirSigns) {
  const Vector rates{{-1e7, 40, -3}};
  constexpr double kMoreThanTheDataAllow = 1e-11;
  constexpr unsigned kRoundings = 8;
  for (int signs = 0; signs < 16; ++signs) {
    const auto sign = [signs](int bit) { return (signs >> bit) % 2 == 0 ? 1.0 : -1.0; };
    for (Index unreached = 0; unreached < 3; ++unreached) {
      const Vector fast{{0.9, 0.7 * sign(0), 0.6 * sign(1)}}, growing{{1, 0.5 * sign(2), 0.35 * sign(3)}};
      Matrix modes(3, 3);
      modes << fast, growing, fast + Vector::Unit(3, unreached);
      Problem problem;
      problem.A = Matrix(modes * rates.asDiagonal() * modes.inverse());
      problem.B = Matrix::Zero(3, 1);
      problem.N = Matrix::Zero(1, 3);
      problem.M = Matrix{{1.0}};
      problem.f = TimeFunction::Zero(3);
      problem.g = TimeFunction::Constant(Vector{{1.0}});
      problem.x0 = modes * Vector{{0, 1, 0.1}};
      problem.horizon = 0.7;
      const Solution solution = SolveAt(problem, kMoreThanTheDataAllow, {problem.horizon});
      const Vector x = LastState(solution);
      double moved = 0;
      for (unsigned seed = 1; seed <= kRoundings; ++seed) {
        const Problem rounded = WithRoundedData(problem, 1, false, seed);
        const Vector change = LastState(SolveAt(rounded, kMoreThanTheDataAllow, {problem.horizon})) - x;
        moved = std::max(moved, MaxAbs(change.cwiseQuotient(x)));
      }
      EXPECT_GT(moved, 1e-10);
      EXPECT_LE(moved, 3 * solution.accuracy.error) << "signs " << signs << ", unreached " << unreached;
    }
  }
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
