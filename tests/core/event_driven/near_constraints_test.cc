// SPDX-License-Identifier: Apache-2.0
// States that stay much closer to a constraint than the tolerance, or start there.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/event_driven/mode_end.h"
#include "core/linalg/bounded_sum.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::kNoTolerance;
using testing::LastState;
using testing::Scalar;
using testing::SolveAt;

// x_1 = sin(12 t) keeps a distance of 1e-9 max(0, -sin(0.683 t)) from the constraint of pair 2, which holds it only
// where that is zero. Pair 1 switches all the while, and at each switch the active set is looked for again. x_2, of
// size 1e-6, integrates the error of x_1 and so shows where x_1 was moved onto the constraint.
TEST(NearConstraintsTest, AStateIsNotMovedOntoAConstraintThatDoesNotHold) {
  Problem problem;
  problem.A = Matrix{{0.0, 0.0}, {1.0, 0.0}};
  problem.B = Matrix{{0.0, 1.0}, {0.0, 0.0}};
  problem.N = Matrix{{0.0, 0.0}, {1.0, 0.0}};
  problem.M = Matrix{{1.0, 0.0}, {0.0, 0.0}};
  problem.f = TimeFunction::Formulas({"12*cos(12*t) - 1e-9*max(0, sin(0.683*t))", "0.731e-6*cos(0.731*t) - sin(12*t)"});
  problem.g = TimeFunction::Formulas({"-sin(11*t)", "1e-9*max(0, -sin(0.683*t)) - sin(12*t)"});
  problem.x0 = Vector{{0.0, 0.0}};
  problem.horizon = 9;
  Options options;
  options.error_tolerance = 1e-6;
  for (int k = 1; k <= 90; ++k) options.output_times.push_back(0.1 * k);
  options.output_times_only = true;
  const Solution solution = testing::SolveWith(problem, options);
  ASSERT_EQ(solution.x.cols(), 90);
  double error = 0;
  for (Index k = 0; k < solution.x.cols(); ++k) {
    const double t = solution.times[static_cast<std::size_t>(k)];
    error = std::max(error, std::abs(solution.x(1, k) / 1e-6 - std::sin(0.731 * t)));
  }
  EXPECT_LE(error, 1e-6);
  EXPECT_LE(error, 3 * solution.accuracy.error);
}

// From t = 0.722 on y_2 = (t - 0.722)^3, and y_1 follows so that w_1 stays zero. By itself y_2 would drive w_2 up, with
// y_1 it drives it down at a rate of 3e7: rounding decides whether y_2 ever begins, and no solve can know.
TEST(NearConstraintsTest, APairThatAnotherRepelsIsNoticed) {
  const std::string y1 = "sin(0.756*t)*sin(1.929*t)", y2 = "max(0, t - 0.722)**3", w2 = "max(0, 0.722 - t)**3";
  const std::string x1 = "(t**2)", x2 = "sin(1.184*t)";
  Problem problem;
  problem.A = Matrix{{-5, 0.33}, {-1.8, -3.42}};
  problem.B = Matrix{{0.4, -0.06}, {-0.43, 0.7}};
  problem.N = Matrix{{0.56, -1.79}, {-0.6, 0.71}};
  problem.M = Matrix{{3.298e-8, -1.2e-9}, {-4.236e-8, 2.212e-8}};
  problem.f =
      TimeFunction::Formulas({"2*t + 5*" + x1 + " - 0.33*" + x2 + " - 0.4*" + y1 + " + 0.06*" + y2,
                              "1.184*cos(1.184*t) + 1.8*" + x1 + " + 3.42*" + x2 + " + 0.43*" + y1 + " - 0.7*" + y2});
  problem.g =
      TimeFunction::Formulas({"-0.56*" + x1 + " + 1.79*" + x2 + " - 3.298e-8*" + y1 + " + 1.2e-9*" + y2,
                              w2 + " + 0.6*" + x1 + " - 0.71*" + x2 + " + 4.236e-8*" + y1 + " - 2.212e-8*" + y2});
  problem.x0 = Vector{{0.0, 0.0}};
  problem.horizon = 1.3;
  Options options;
  options.error_tolerance = 1e-6;
  options.output_times = {1.3};
  options.output_times_only = true;
  const Solution solution = testing::SolveWith(problem, options);
  ASSERT_EQ(solution.x.cols(), 1);
  const double error = std::abs(solution.x(0, 0) / 1.69 - 1);
  EXPECT_LE(error, 3 * solution.accuracy.error + 1e-12);
}

// A put option: V_i >= max(0, K - S_i), and at first V is equal to that. Beyond the strike V and y are zero, and far
// beyond it V remains smaller than any rounding error.
TEST(NearConstraintsTest, StatesThatAreNotReachedYetActivateNothing) {
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

// x' = 1 + v with v in Sgn(x), and scaled by powers of two: a relay that drives x away from 0. From 0 there are
// solutions on both sides; from every other x0 one of them, on its side.
TEST(NearConstraintsTest, ARepellingRelayFollowsTheSignOfItsStart) {
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

// Of numbers that are sums themselves, such as 0.1 + 0.2 - 0.3, the sign is rounding: a relay that attracts x holds it
// at 0 from there, at once.
TEST(NearConstraintsTest, AStartThatIsRoundingRests) {
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

// Starts where y = w = 0, and y drives w down (N B < 0) with the rate 1/M: x = t², y = sin³t, from which whatever
// rounding does to w moves away like e^{t/M}. Where w leaves zero at once rounding decides nothing.
TEST(NearConstraintsTest, CountsASolutionThatRoundingDecides) {
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
TEST(NearConstraintsTest, FindsShallowContactsOrCountsThem) {
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

// What a SOLVED promises of w_i: an error of `allowed`, or of twice the rounding where it is named.
double AllowedOfSlack(const Solution& solution, Index i, double allowed) {
  for (const NamedComponent& named : solution.accuracy.named) {
    if (named.component == Component{ComponentKind::kSlack, i}) return 2 * named.rounding;
  }
  return allowed;
}

// x = 1000 + gap falls with speed 7. A contact that begins at once moves x by no more than its tolerance, but w by all
// that it is.
TEST(NearConstraintsTest, CountsAStartThatIsMovedOntoAConstraint) {
  int solved = 0;
  for (const double gap : {1e-2, 1e-4, 1e-5, 1e-6, 1e-8}) {
    for (const double tolerance : {1e-4, 1e-6, 1e-9}) {
      Problem problem;
      problem.A = Matrix{{0.0}};
      problem.B = problem.N = Matrix{{1.0}};
      problem.M = Matrix{{0.0}};
      problem.f = TimeFunction::Constant(Vector{{-7.0}});
      problem.g = TimeFunction::Constant(Vector{{-1000.0}});
      problem.x0 = Vector{{1000 + gap}};
      problem.horizon = 1;
      const Solution solution = SolveAt(problem, tolerance, {0, 0.5, 1});
      if (JudgeSolution(solution).kind != VerdictKind::kSolved) continue;
      ++solved;
      const double w = problem.x0[0] - 1000;
      EXPECT_LE(std::abs(solution.w(0, 0) - w), AllowedOfSlack(solution, 0, tolerance * w))
          << gap << ", tolerance " << tolerance;
    }
  }
  EXPECT_GE(solved, 12);  // of 15; the others have too few digits beside 1000
}

// x' = -1 + y beside w = x + gap + y, and another pair that rises. The first one is active from t = gap on, a tiny
// part of the step: so long w is all that it ever is.
TEST(NearConstraintsTest, KnowsTheSlackOfAPairThatIsActiveSoon) {
  int solved = 0;
  for (const double gap : {1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-8, 1e-6}) {
    for (const double tolerance : {1e-4, 1e-6, 1e-9}) {
      Problem problem;
      problem.A = Matrix::Zero(2, 2);
      problem.B = problem.N = problem.M = Matrix::Identity(2, 2);
      problem.f = TimeFunction::Constant(Vector{{-1.0, 1.0}});
      problem.g = TimeFunction::Constant(Vector{{gap, 1e-14}});
      problem.x0 = Vector::Zero(2);
      problem.horizon = 1;
      const Solution solution = SolveAt(problem, tolerance, {0, gap / 4, gap / 2, 1});
      if (JudgeSolution(solution).kind != VerdictKind::kSolved) continue;
      ++solved;
      for (Index k = 0; k < 3; ++k) {
        const double exact = gap - solution.times[static_cast<std::size_t>(k)];
        EXPECT_LE(std::abs(solution.w(0, k) - exact), AllowedOfSlack(solution, 0, tolerance * gap))
            << gap << ", tolerance " << tolerance << ", " << k;
      }
    }
  }
  EXPECT_GE(solved, 21);
}

// Between y = 0 and the solution that leaves it as e^{rate t} rounding decides, also where no step is as long as that
// takes.
TEST(RepelledStartsTest, GrowOverStepsUntilRoundingDecides) {
  constexpr double kNoise = 1e-16, kRate = 15;  // 30 times in a step
  const LegendreVector zero = LegendreVector::Zero();
  RepelledStarts starts(1);
  EXPECT_EQ(starts.Follow(0, zero, kRate, kNoise, 1), 0);
  EXPECT_NEAR(starts.Follow(0, zero, kRate, kNoise, 1) / (kNoise / kUlp), 1, 0.2);
}

TEST(RepelledStartsTest, AreNoneWhereTheConstraintIsLeftAtOnce) {
  LegendreVector rising = LegendreVector::Zero();
  rising[0] = rising[1] = 1e-3;  // (1 + s) / 1000
  RepelledStarts starts(1);
  for (int step = 0; step < 3; ++step) EXPECT_EQ(starts.Follow(0, rising, 15, 1e-16, 1), 0);
}

TEST(RepelledStartsTest, EndWithTheirMode) {
  const LegendreVector zero = LegendreVector::Zero();
  RepelledStarts starts(1);
  for (int step = 0; step < 3; ++step) {
    EXPECT_EQ(starts.Follow(0, zero, 15, 1e-16, 1), 0);
    starts.End(0);
  }
}

// w = x - 0.3 + y/2 falls from zero at the given speed, or from what rounding makes of zero: then y is active a
// rounding later.
TEST(StartsAtTheEdgeTest, HaveTheErrorOfRoundingOverSpeed) {
  for (const double speed : {1e-3, 1.0, 1e6}) {
    SCOPED_TRACE(speed);
    Problem problem = testing::Scalar(0, -0.3, 0.3, 1);
    problem.B(0, 0) = 0.5;
    problem.N(0, 0) = 1;
    problem.M(0, 0) = 0.5;
    problem.f = TimeFunction::Constant(Vector::Constant(1, -speed));
    const Solution solution = SolveAt(problem, 1e-9);
    ASSERT_FALSE(solution.switching_times.empty());
    EXPECT_EQ(solution.switching_times[0].time, 0);
    EXPECT_EQ(solution.switching_times[0].entering.size(), 1u);
    EXPECT_GE(solution.switching_times[0].error, 0.3 * std::numeric_limits<double>::epsilon() / speed);
    EXPECT_LE(solution.switching_times[0].error, std::max(16 * std::numeric_limits<double>::epsilon() / speed, 1e-17));
    problem.x0[0] = 0.5;
    EXPECT_LE(SolveAt(problem, 1e-9).switching_times[0].error, 1e-16);
  }
}

}  // namespace
}  // namespace dlcs
