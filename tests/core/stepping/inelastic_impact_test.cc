// SPDX-License-Identifier: Apache-2.0
// Masses that fall on floors: closed forms of relative degree two.

#include "core/stepping/inelastic_impact.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

constexpr double kGravity = 9.81;

// A unit mass at height x1 above a floor that moves as -g: x1'' = y - gravity, gap x1 + g.
Problem FallingMass(double height, double velocity, const std::string& floor, double horizon) {
  Problem problem;
  problem.A = Matrix::Zero(2, 2);
  problem.A(0, 1) = 1;
  problem.B = Vector::Unit(2, 1);
  problem.N = Vector::Unit(2, 0).transpose();
  problem.M = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Constant(Vector{{0, -kGravity}});
  problem.g = TimeFunction::Formulas({floor});
  problem.x0 = Vector{{height, velocity}};
  problem.horizon = horizon;
  return problem;
}

Solution Solved(const Problem& problem, Index steps) {
  Options options;
  options.num_steps = steps;
  options.inelastic_impact = true;
  return testing::SolveWith(problem, options);
}

TEST(InelasticImpactTest, AMassFallsAndStays) {
  const Problem problem = FallingMass(1, 0, "0", 1);
  const double impact = std::sqrt(2 / kGravity);
  for (const Index steps : {500, 2000, 8000}) {
    const Solution solution = Solved(problem, steps);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    ASSERT_EQ(solution.jumps.size(), 1u);
    const double h = 1.0 / static_cast<double>(steps);
    EXPECT_NEAR(solution.jumps[0].time, impact, 1.001 * h);
    EXPECT_NEAR(solution.jumps[0].multiplier[0], kGravity * impact, kGravity * 1.001 * h);
    double error = 0;
    for (size_t k = 0; k < solution.times.size(); ++k) {
      const double t = solution.times[k];
      const double exact = t < impact ? 1 - kGravity * t * t / 2 : 0;
      error = std::max(error, std::abs(solution.x(0, static_cast<Index>(k)) - exact));
    }
    EXPECT_LT(error, 1e-11) << "it flies on a parabola and is not left inside the floor";
    EXPECT_NEAR(solution.x(1, solution.x.cols() - 1), 0, 1e-12);
    EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), 0, 1e-12) << "not inside the floor";
    EXPECT_NEAR(solution.y(0, solution.y.cols() - 1), kGravity, 1e-9) << "the floor carries the weight";
  }
}

// x1'' = y + sin t - 1/2 over a floor: at rest until the push is as large as the weight, and again after one flight.
TEST(InelasticImpactTest, AMassAtRestIsNotHitByRounding) {
  Problem problem = FallingMass(0, 0, "0", 6);
  problem.f = TimeFunction::Formulas({"0", "sin(t)-0.5"});
  const double leaves = std::numbers::pi / 6, lands = 5.182450;
  for (const Index steps : {100, 1000, 1002, 2000, 10000}) {
    const Solution solution = Solved(problem, steps);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    const double h = 6.0 / static_cast<double>(steps);
    ASSERT_EQ(solution.jumps.size(), 1u) << steps;
    EXPECT_NEAR(solution.jumps[0].time, lands, 2 * h);
    for (std::size_t k = 1; k < solution.times.size() && solution.times[k] < leaves; ++k) {
      EXPECT_NEAR(solution.y(0, static_cast<Index>(k)), 0.5 - std::sin(solution.times[k]), h) << solution.times[k];
    }
  }
}

// Of the position, relative to the height of one that it falls from.
double ErrorOfTheFall(const Solution& solution) {
  const double impact = std::sqrt(2 / kGravity);
  double error = 0;
  for (std::size_t k = 0; k < solution.times.size(); ++k) {
    const double t = solution.times[k];
    const double exact = t < impact ? 1 - kGravity * t * t / 2 : 0;
    error = std::max(error, std::abs(solution.x(0, static_cast<Index>(k)) - exact));
  }
  return error;
}

TEST(InelasticImpactTest, HasAnEstimate) {
  for (const Index steps : {50, 137, 500, 2001}) {
    const Solution solution = Solved(FallingMass(1, 0, "0", 1), steps);
    ASSERT_EQ(solution.accuracy.source, AccuracySource::kCompared) << solution.accuracy.note;
    EXPECT_GE(solution.accuracy.error, ErrorOfTheFall(solution) / 3) << steps;
  }
  // A flight that begins where the push exceeds the weight, some time in a step.
  Problem problem = FallingMass(0, 0, "0", 4);
  problem.f = TimeFunction::Formulas({"0", "sin(t)-0.5"});
  const Solution fine = Solved(problem, 512000);
  for (const Index steps : {100, 250, 1000}) {
    const Solution solution = Solved(problem, steps);
    const double error = std::abs(solution.x.rightCols(1)(0, 0) - fine.x.rightCols(1)(0, 0)) / MaxAbs(fine.x.row(0));
    EXPECT_GE(solution.accuracy.errors.x.truncation[0], error * solution.accuracy.errors.x.own[0] / 3) << steps;
    EXPECT_GT(error, 1e-7) << "what there is to estimate";
  }
}

TEST(InelasticImpactTest, TakesTheStepsThatAnErrorNeeds) {
  Options options;
  options.inelastic_impact = true;
  options.error_tolerance = 1e-3;
  const Solution solution = testing::SolveToEnd(FallingMass(1, 0, "0", 1), options);
  EXPECT_LE(solution.accuracy.error, 1e-3);
  EXPECT_LE(ErrorOfTheFall(solution), 1e-3);
}

TEST(InelasticImpactTest, RefusesWhatItCannotPromise) {
  const auto message = [](const Options& asked) {
    Options options = asked;
    options.inelastic_impact = true;
    const Solution solution = testing::SolveWith(FallingMass(1, 0, "0", 1), options);
    EXPECT_EQ(solution.termination, Termination::kUnsupported);
    return solution.message;
  };
  Options options;
  options.method = Method::kEventDriven;
  EXPECT_THAT(message(options), ::testing::HasSubstr("but the method is set to event-driven"));
}

TEST(InelasticImpactTest, AMassOnAShakenTableLeavesItWhenTheTableFallsFaster) {
  // Table at a sin ωt with a ω² > gravity: contact is lost when -a ω² sin ωt = -gravity, then free flight.
  const double a = 0.05, omega = 20, leaves = std::asin(kGravity / (a * omega * omega)) / omega;
  const Problem problem = FallingMass(0, a * omega, "-0.05*sin(20*t)", 0.1);
  const Solution solution = Solved(problem, 20000);
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  for (size_t k = 0; k < solution.times.size(); k += 100) {
    const double t = solution.times[k], s = t - leaves;
    const double exact =
        t < leaves ? a * std::sin(omega * t)
                   : a * std::sin(omega * leaves) + a * omega * std::cos(omega * leaves) * s - kGravity * s * s / 2;
    EXPECT_NEAR(solution.x(0, static_cast<Index>(k)), exact, 1e-5) << t;
    const double force = t < leaves ? kGravity - a * omega * omega * std::sin(omega * t) : 0;
    if (k > 0 && std::abs(t - leaves) > 1e-4) {
      EXPECT_NEAR(solution.y(0, static_cast<Index>(k)), force, 2e-3) << t;
    }
  }
}

TEST(InelasticImpactTest, TwoMassesShareTheirMomentum) {
  // Mass 1 runs into mass 2 at rest, of three times its mass: both go on with a quarter of the speed.
  Problem problem;
  problem.A = Matrix::Zero(4, 4);
  problem.A(0, 2) = problem.A(1, 3) = 1;
  problem.B = Vector{{0, 0, -1, 1.0 / 3}};
  problem.N = Matrix{{-1, 1, 0, 0}};
  problem.M = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Constant(Vector::Zero(4));
  problem.g = TimeFunction::Constant(Vector::Zero(1));
  problem.x0 = Vector{{0, 0.5, 1, 0}};
  problem.horizon = 1;
  const Solution solution = Solved(problem, 1000);
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  const Vector end = solution.x.col(solution.x.cols() - 1);
  EXPECT_NEAR(end[2], 0.25, 1e-12);
  EXPECT_NEAR(end[3], 0.25, 1e-12);
  EXPECT_NEAR(end[0], end[1], 1.1e-3);
  EXPECT_NEAR(end[0], 0.5 + 0.25 * 0.5, 1.1e-3);
}

TEST(InelasticImpactTest, IsRefusedUnlessAskedFor) {
  const Problem problem = FallingMass(1, 0, "0", 1);
  Observer silent;
  const auto refused = Solve(problem, Options{}, silent, {});
  ASSERT_TRUE(refused.ok());
  EXPECT_EQ(refused->termination, Termination::kUnsupported);
  EXPECT_NE(refused->message.find("inelastic impact"), std::string::npos) << refused->message;
  const Solution labeled = Solved(problem, 100);
  ASSERT_EQ(labeled.warnings.size(), 1u);
  EXPECT_NE(labeled.warnings[0].find("inelastic impact"), std::string::npos);
}

TEST(InelasticImpactTest, DegreeThreeStaysRefused) {
  const testing::Case the_case = testing::LoadCase("outside_triple_integrator");
  const Solution solution = Solved(the_case.problem, 100);
  EXPECT_EQ(solution.termination, Termination::kUnsupported);
}

TEST(InelasticImpactTest, DoesNotOpenAGapThatIsClosedTooFar) {
  EXPECT_EQ(Solved(FallingMass(-0.1, 0, "0", 1), 100).termination, Termination::kInconsistentState);
  Problem rising = FallingMass(0, 0, "0", 1);
  rising.g.pieces = {{0, ConstantFunction{Vector::Zero(1)}}, {0.5, ConstantFunction{Vector::Constant(1, -1)}}};
  const Solution solution = Solved(rising, 100);
  EXPECT_EQ(solution.termination, Termination::kInfeasible);
  EXPECT_EQ(solution.failure_time, 0.5);
}

}  // namespace
}  // namespace dlcs
