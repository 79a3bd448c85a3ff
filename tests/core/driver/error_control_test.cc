// SPDX-License-Identifier: Apache-2.0
// A tolerance instead of a step: what is promised holds, for every method, on every case.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "core/context/component_errors.h"
#include "core/linalg/norms.h"
#include "core/models/obstacle.h"
#include "core/problem/verdict.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

using testing::ExampleFourOne;
using testing::ExampleFourOneExact;
using testing::LoadCase;

Solution SolveFor(const Problem& problem, Options options) {
  options.project_initial_state = true;
  Observer silent;
  auto solution = Solve(problem, options, silent, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return solution.ok() ? *std::move(solution) : Solution{};
}

Options Within(double error, Method method = Method::kAuto) {
  Options options;
  options.method = method;
  options.error_tolerance = error;
  return options;
}

// At the times of `solution`, to 1e-12 by a method that shares no step with the others.
Solution ReferenceFor(const Problem& problem, const Solution& solution) {
  Options options = Within(1e-12, Method::kEventDriven);
  options.output_times = solution.times;
  options.output_times_only = true;
  return SolveFor(problem, options);
}

// x' = f, or x' = y where 0 <= y ⟂ y + g >= 0: x(10) is an integral. Nothing moves but in a pulse somewhere.
Problem IntegralOf(const std::string& f, const std::string& g) {
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = problem.M = Matrix::Ones(1, 1);
  problem.N = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Formulas({f});
  problem.g = TimeFunction::Formulas({g});
  problem.x0 = Vector::Zero(1);
  problem.horizon = 10;
  return problem;
}

struct Pulse {
  const char *f, *g;
  double integral;
};
class PulseTest : public ::testing::TestWithParam<Pulse> {};

// Pulses longer than a 64th of T, in which no node of a long step need lie. Event location is tried first; some have
// kinks that it leaves to steps.
TEST_P(PulseTest, IsSeenWhoeverIsChosen) {
  constexpr double kTolerance = 1e-6;
  const Solution solution = SolveFor(IntegralOf(GetParam().f, GetParam().g), Within(kTolerance));
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), GetParam().integral, kTolerance * GetParam().integral);
}

INSTANTIATE_TEST_SUITE_P(Pulses, PulseTest,
                         ::testing::Values(Pulse{"max(0,1-((t-3.6)/0.3)^2)^3", "100", 0.3 * 32 / 35},
                                           Pulse{"max(0,1-((t-3.65)/0.35)^2)^3", "100", 0.35 * 32 / 35},
                                           Pulse{"max(0,1-((t-7.1)/0.08)^2)^3", "100", 0.08 * 32 / 35},
                                           Pulse{"max(0,0.3-abs(t-3.6))", "100", 0.09},
                                           Pulse{"exp(-((t-3.3)/0.1)^2)", "100", 0.1 * std::sqrt(std::acos(-1))},
                                           Pulse{"0", "0.1-max(0,0.3-abs(t-3.6))", 0.04},
                                           Pulse{"0", "1-2*(3.3<t)*(t<3.9)", 0.6}));

// y is a thousandth of g, which is steep: what t is rounded by is more of y than the last tolerance, and the figure may
// say so.
TEST(EventToleranceTest, IsKeptWhereSourcesAreSteep) {
  Problem problem = IntegralOf("0", "0.999-sin(50*t)");
  problem.horizon = 6;
  const double angle = std::acos(0.999), integral = 48 * (2 * std::sin(angle) - 2 * 0.999 * angle) / 50;
  for (const double tolerance : {1e-8, 1e-10, 1e-11}) {
    const Solution solution = SolveFor(problem, Within(tolerance, Method::kEventDriven));
    if (tolerance > 1e-11 || solution.accuracy.error <= tolerance) {
      ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    }
    EXPECT_EQ(solution.cost.coupled_steps, 0);
    EXPECT_LT(solution.cost.steps, 1000);
    EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), integral,
                std::max(tolerance, solution.accuracy.error) * integral);
  }
}

// All of 64, 128, 256 and 512 nodes put the same number of steps, in all, behind these jumps.
TEST(TrialStepsTest, GridsThatAgreeByChanceAreNotBelieved) {
  for (const auto& [f, integral] : std::vector<std::pair<std::string, double>>{
           {"(t>3.3)*1", 6.7}, {"(3.3<t)*(t<4.3)", 1}, {"(0.4<t)*(t<3.4)", 3}}) {
    constexpr double kTolerance = 1e-4;
    const Solution solution = SolveFor(IntegralOf(f, "100"), Within(kTolerance, Method::kTimeStepping));
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), integral, kTolerance * integral) << f;
  }
}

using CaseAndMethod = std::tuple<const char*, Method>;
class ErrorToleranceTest : public ::testing::TestWithParam<CaseAndMethod> {};

// The methods of first order are asked for less.
TEST_P(ErrorToleranceTest, IsKept) {
  const auto [name, method] = GetParam();
  const Problem problem = LoadCase(name).problem;
  const bool first_order = method == Method::kTimeStepping;
  for (const double tolerance : first_order ? std::vector{1e-1, 1e-2} : std::vector{1e-2, 1e-4, 1e-5}) {
    const Solution solution = SolveFor(problem, Within(tolerance, method));
    if (solution.termination == Termination::kUnsupported) return;  // the iteration, where y is no function
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    const Solution exact = ReferenceFor(problem, solution);
    ASSERT_EQ(exact.times, solution.times);
    EXPECT_LE(RelativeDifference(solution.x, exact.x), tolerance) << solution.message;
    EXPECT_LE(solution.accuracy.error, tolerance) << "no estimate";
    if (solution.accuracy.errors.y.size() > 0) {
      EXPECT_LE(RelativeDifference(problem.B * solution.y, problem.B * exact.y), tolerance) << solution.message;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, ErrorToleranceTest,
                         ::testing::Combine(::testing::Values("abb_circuit_a", "abb_circuit_c", "american_put",
                                                              "diode_bridge_cap", "formula_zoo", "leontief_stock",
                                                              "observer_lcs", "relay_sliding", "rlcd", "saturated_pd",
                                                              "vickrey", "z_least"),
                                            ::testing::Values(Method::kAuto, Method::kExponentialIntegrator,
                                                              Method::kLaplaceIteration, Method::kTimeStepping)),
                         [](const auto& test) {
                           std::string name =
                               std::string(std::get<0>(test.param)) + "_" + MethodName(std::get<1>(test.param));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

double ErrorOfFourOne(const Solution& solution) {
  double error = 0;
  for (std::size_t k = 0; k < solution.times.size(); ++k) {
    error = NanMax(error, MaxAbs(solution.x.col(static_cast<Index>(k)) - ExampleFourOneExact(solution.times[k])));
  }
  return error;
}

TEST(ErrorToleranceOptionTest, OfWuChenIterationIncludesItsContour) {
  Options options = Within(1e-3, Method::kWuChenIteration);
  options.num_contour_nodes = 2;  // too few: e^{-2.06 √2} = 0.05
  const Solution solution = SolveFor(ExampleFourOne(), options);
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_LE(ErrorOfFourOne(solution), 1e-4);  // x1 stays near 0.1
  EXPECT_LE(solution.accuracy.error, 1e-3);
  EXPECT_GT(solution.contour.value().nodes, 2);
}

TEST(ErrorToleranceOptionTest, LeavesOutputWhereItWasAskedFor) {
  Options options = Within(1e-4, Method::kExponentialIntegrator);
  options.output_times = {0.1, 0.55};
  options.output_times_only = true;
  EXPECT_EQ(SolveFor(ExampleFourOne(), options).times, (std::vector<double>{0.1, 0.55}));
  options.output_times.clear();
  options.output_times_only = false;
  options.num_steps = 10;
  const Solution tenths = SolveFor(ExampleFourOne(), options);
  ASSERT_EQ(tenths.times.size(), 11u);
  EXPECT_DOUBLE_EQ(tenths.times[1], 0.1);
  EXPECT_GT(tenths.cost.steps, 100);
  EXPECT_LE(ErrorOfFourOne(tenths), 1e-5);
}

TEST(ErrorToleranceOptionTest, SaysWhatWasReachedWhereItIsOutOfReach) {
  Options options = Within(1e-12, Method::kTimeStepping);
  const Solution solution = SolveFor(ExampleFourOne(), options);
  EXPECT_EQ(solution.termination, Termination::kReachedEnd);
  EXPECT_FALSE(JudgeSolution(solution).success);
  EXPECT_NE(solution.message.find("more steps than are allowed"), std::string::npos) << solution.message;
  EXPECT_TRUE(std::isnan(solution.failure_time));
  EXPECT_EQ(solution.times.back(), 1);
  const double estimate = solution.accuracy.error * solution.certificate.x_scale;
  EXPECT_LT(ErrorOfFourOne(solution), 2 * estimate);
  EXPECT_GT(ErrorOfFourOne(solution), estimate / 100);
}

TEST(ErrorToleranceOptionTest, ChoosesEventLocationAndSaysWhy) {
  const Solution solution = SolveFor(ExampleFourOne(), Within(1e-8));
  EXPECT_NE(solution.reason.find("for an error of 1e-08"), std::string::npos) << solution.reason;
  EXPECT_LE(ErrorOfFourOne(solution), 1e-9);
  EXPECT_EQ(SolveFor(ExampleFourOne(), Within(1e-2)).method, Method::kEventDriven);
}

// Heat on a line, without contact: each sine decays at its own rate. The start has a jump, so all of them matter.
TEST(ErrorToleranceOptionTest, ResolvesTheDecayOfARoughStartInFewSteps) {
  constexpr Index kStates = 300;
  constexpr double kTolerance = 1e-4;
  const double scale = (kStates + 1) * (kStates + 1);
  std::vector<Eigen::Triplet<double>> entries;
  Problem problem;
  problem.x0 = Vector::Zero(kStates);
  for (Index i = 0; i < kStates; ++i) {
    entries.emplace_back(i, i, -2 * scale);
    if (i > 0) entries.emplace_back(i, i - 1, scale);
    if (i + 1 < kStates) entries.emplace_back(i, i + 1, scale);
    if (i < kStates / 3) problem.x0[i] = 1;
  }
  SparseMatrix A(kStates, kStates), one(kStates, 1);
  A.setFromTriplets(entries.begin(), entries.end());
  one.insert(0, 0) = 1;
  problem.A = A;
  problem.B = one;
  problem.N = SparseMatrix(one.transpose());
  problem.M = Matrix::Identity(1, 1);
  problem.f = TimeFunction::Zero(kStates);
  problem.g = TimeFunction::Constant(Vector::Constant(1, 10));
  problem.horizon = 0.1;
  Options options = Within(kTolerance);
  options.propagator = PropagatorKind::kSparseStepping;
  options.output_times = {1e-5, 1e-4, 1e-3, 0.01, 0.1};
  options.output_times_only = true;
  const Solution solution = SolveFor(problem, options);
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  Matrix exact = Matrix::Zero(kStates, solution.x.cols());
  for (Index k = 1; k <= kStates; ++k) {
    const double angle = M_PI * static_cast<double>(k) / (kStates + 1);
    Vector mode(kStates);
    for (Index i = 0; i < kStates; ++i) mode[i] = std::sin(angle * static_cast<double>(i + 1));
    const double start = mode.dot(problem.x0) / mode.squaredNorm();
    const double rate = 4 * scale * std::pow(std::sin(angle / 2), 2);
    for (Index j = 0; j < exact.cols(); ++j) {
      exact.col(j) += start * std::exp(-rate * solution.times[static_cast<std::size_t>(j)]) * mode;
    }
  }
  EXPECT_LE((solution.x - exact).cwiseAbs().maxCoeff(), kTolerance);
  // Equal steps would have to be as short as the first of these, some 30,000 of them.
  EXPECT_LE(solution.cost.steps, 4000);
}

// The system is small and the steps are many: the solves before the last one are not its set-up.
TEST(ErrorToleranceOptionTest, CountsTheStagesOfAllSolves) {
  Options options = Within(2e-11, Method::kExponentialIntegrator);
  const Cost controlled = SolveFor(ExampleFourOne(), options).cost;
  options.error_tolerance = 0;
  options.num_steps = 200'000;
  const Cost compared = SolveFor(ExampleFourOne(), options).cost;
  for (const Cost& cost : {controlled, compared}) {
    EXPECT_GE(cost.steps, 100'000);
    const double sum = cost.seconds_setup + cost.seconds_lcp + cost.seconds_linear + cost.seconds_certificate;
    EXPECT_LE(sum, cost.seconds_total);
    EXPECT_LT(cost.seconds_setup, 0.2 * cost.seconds_total);
  }
}

// Steps of two stages above an obstacle, beside implicit Euler of the same steps, with Euler of far shorter steps as
// the second method.
TEST(ErrorToleranceOptionTest, TakesTwoStagesAboveAnObstacle) {
  Problem problem = *MakeObstacleProblem({.cells = 250, .coefficient = 0.5, .horizon = 0.2, .load = "-2*sin(20*t)"});
  problem.A = problem.A.Sparse();
  Options options;
  options.num_steps = 400;
  options.propagator = PropagatorKind::kSparseStepping;
  options.estimate_error = false;
  const Solution two_stages = SolveFor(problem, options);
  EXPECT_NE(two_stages.reason.find("two stages"), std::string::npos) << two_stages.reason;
  options.method = Method::kTimeStepping;
  const Solution euler = SolveFor(problem, options);
  const auto last = [](const Solution& solution) { return Vector(solution.x.rightCols(1)); };
  std::vector<Vector> fine;
  for (const Index steps : {6400, 12800}) {
    options.num_steps = steps;
    fine.push_back(last(SolveFor(problem, options)));
  }
  const Vector reference = 2 * fine[1] - fine[0];
  const double error = (last(two_stages) - reference).cwiseAbs().maxCoeff();
  EXPECT_LE(error, 0.05 * (last(euler) - reference).cwiseAbs().maxCoeff());
  EXPECT_LE(two_stages.certificate.node_residual, 1e-10);
}

// x' = -x + y + 5 cos²(2π 4096 t), y = max(0, 1 - x): grids of 64 to 8192 steps see the constant 5. A sine in [0, 1e6]
// has many periods in each of their steps.
TEST(TrialStepsTest, SourcesThatAllGridsSeeAtOnePhaseAreNotBelieved) {
  Problem problem = testing::Scalar(-1, 1, 1, 1);
  problem.g = TimeFunction::Constant(Vector::Constant(1, -1));
  problem.f = TimeFunction::Formulas({"5*cos(2*pi*4096*t)^2"});
  problem.x0 = Vector::Zero(1);
  problem.horizon = 1;
  const double reaches_one = 0.5 * std::log(7.0 / 3);  // of x' = 3.5 - 2x; then x' = 2.5 - x
  const double exact = 2.5 - 1.5 * std::exp(reaches_one - 1);
  for (const Method method : {Method::kAuto, Method::kExponentialIntegrator, Method::kLaplaceIteration}) {
    const Solution solution = SolveFor(problem, Within(1e-3, method));
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), exact, 2e-3) << MethodName(method);
  }
  Options by_default;
  const Solution resolved = SolveFor(problem, by_default);  // by steps between events, which see all of f
  EXPECT_TRUE(JudgeSolution(resolved).success);
  EXPECT_NEAR(resolved.x(0, resolved.x.cols() - 1), exact, 1e-4);
  by_default.method = Method::kExponentialIntegrator;
  EXPECT_FALSE(JudgeSolution(SolveFor(problem, by_default)).success);
  problem.f = TimeFunction::Formulas({"sin(t)"});
  problem.horizon = 1e6;
  for (const Method method : {Method::kAuto, Method::kExponentialIntegrator, Method::kTimeStepping}) {
    by_default.method = method;
    EXPECT_FALSE(JudgeSolution(SolveFor(problem, by_default)).success) << MethodName(method);
  }
}

// A source that is singular at a single time, and steep beside it, is resolved elsewhere.
TEST(TrialStepsTest, ASingularTimeIsNoUnresolvedSource) {
  Problem problem = testing::Scalar(-1, 1, 1, 1);
  problem.horizon = 5;
  for (const char* f : {"abs(t - 2)^0.3", "sqrt(t)", "atan(1e9*(t - 2))"}) {
    problem.f = TimeFunction::Formulas({f});
    const Solution solution = SolveFor(problem, Within(1e-4, Method::kExponentialIntegrator));
    EXPECT_EQ(solution.termination, Termination::kReachedEnd) << f << ": " << solution.message;
    EXPECT_TRUE(JudgeSolution(solution).success) << f << ": " << JudgeSolution(solution).text;
  }
}

// x_1 is held at an offset, beside which an LCP counts as zero what x_2 is made of, and steps add less to x_1 than an
// ulp: x_2 falls by as much as x_1 would without the contact.
TEST(ErrorEstimateTest, CountsWhatAnLcpTakesForZero) {
  const double least = [] {  // of x_1 - offset without the contact
    double least = 0;
    for (int k = 0; k <= 100000; ++k) {
      const double t = 1e-5 * k;
      least = std::min(least, 0.25 + 4 * t * t - 2.25 * t - 0.01 * std::sin(100 * t));
    }
    return least;
  }();
  int solved = 0;
  for (const double offset : {0.0, 1e6, 1e9, 1e11, 1e12, 1e13}) {
    Problem problem;
    problem.A = Matrix::Zero(2, 2);
    problem.B = Matrix{{1}, {-1}};
    problem.N = Matrix{{1, 0}};
    problem.M = Matrix::Zero(1, 1);
    problem.f = TimeFunction::Formulas({"8*(t-0.28125)-cos(100*t)", "0"});
    problem.g = TimeFunction::Constant(Vector::Constant(1, -offset));
    problem.x0 = Vector{{offset + 0.25, -0.25}};
    problem.horizon = 1;
    for (const Method method : {Method::kExponentialIntegrator, Method::kTimeStepping}) {
      for (const double tolerance : {1e-2, 1e-4}) {
        const Solution solution = SolveFor(problem, Within(tolerance, method));
        if (!JudgeSolution(solution).success) continue;
        ++solved;
        const double error = std::abs(solution.x(1, solution.x.cols() - 1) - (least - 0.25));
        EXPECT_LE(error, tolerance * (0.25 - least)) << offset << " " << MethodName(method) << " " << tolerance;
      }
    }
  }
  EXPECT_GE(solved, 8);  // beside 0 and 1e6
}

// Where y is no function of x, its error is not estimated, and what is allowed of it decides nothing.
TEST(ErrorEstimateTest, AbsoluteTolerancesOfPairsMayStandBesideErrorsOfStatesAlone) {
  Problem problem = testing::Scalar(-1, 0, 1, 3);
  problem.M = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Constant(Vector{{-2.0}});
  for (const Method method : {Method::kExponentialIntegrator, Method::kTimeStepping}) {
    for (const double tolerance : {1e-3, 0.0}) {
      Options options = Within(tolerance, method);
      if (tolerance == 0) options.num_steps = 100;
      options.absolute_tolerances = {{{ComponentKind::kPair, 0}, 1e-3}, {{ComponentKind::kSlack, 0}, 1e-3}};
      const Solution solution = SolveFor(problem, options);
      EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
      EXPECT_EQ(solution.accuracy.errors.y.size(), 0);
    }
  }
}

// Ten steps of 0.1 see a source of 40 Hz at the same phase, and so do five and two.
TEST(ErrorEstimateTest, IsNotSmallWhereStepsMissTheOscillationOfASource) {
  for (const bool of_state : {true, false}) {
    Problem problem = testing::Scalar(-1, 1, 1, 1);
    TimeFunction& source = of_state ? problem.f : problem.g;
    source = TimeFunction::Formulas({of_state ? "100*cos(80*pi*t)" : "1 - 2*sin(40*pi*t)^2"});
    for (const Method method : {Method::kExponentialIntegrator, Method::kTimeStepping, Method::kLaplaceIteration}) {
      Options options;
      options.method = method;
      options.num_steps = 10;
      const Solution aliased = SolveFor(problem, options);
      EXPECT_FALSE(JudgeSolution(aliased).success) << MethodName(method) << ": " << JudgeSolution(aliased).text;
      options.num_steps = 4000;
      const Solution resolved = SolveFor(problem, options);
      EXPECT_TRUE(JudgeSolution(resolved).success) << MethodName(method) << ": " << JudgeSolution(resolved).text;
    }
  }
}

// A source that is zero but for rounding is no oscillation.
TEST(ErrorEstimateTest, IsNotRaisedByTheRoundingOfASource) {
  Problem problem = testing::Scalar(-1, 1, 1, 1);
  problem.f = TimeFunction::Formulas({"sin(50*t)^2 + cos(50*t)^2 - 1"});
  Options options;
  options.method = Method::kExponentialIntegrator;
  options.num_steps = 100;
  EXPECT_LT(SolveFor(problem, options).accuracy.error, 1e-3);
}

}  // namespace
}  // namespace dlcs
