// SPDX-License-Identifier: Apache-2.0
// Relays: hysteresis, sliding, and switches that accumulate.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/problem/verdict.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::kNoTolerance;
using testing::LastActive;
using testing::LastState;
using testing::Relays;
using testing::SolveAt;
using testing::SwitchesOf;

// A relay with hysteresis: x' = 1 - 2u, and u goes to 1 where x rises to 0 and to 0 where x falls to -1/2. So x is a
// triangle with a period of 1.
TEST(RelaysTest, ARelayKeepsItsStateWithinItsHysteresis) {
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

// The oscillation of a relay behind a double integrator: parabolas, switches √2, 3√2, 5√2, ...
TEST(RelaysTest, SwitchesARelayBehindTwoIntegrators) {
  Matrix A = Matrix::Zero(2, 2);
  A(0, 1) = 1;
  const Solution solution = SolveAt(Relays(A, Vector{{0, 1}}, Vector{{1, 0}}.transpose(), Vector{{1, 0}}, 20), 1e-9);
  const std::vector<double> times = SwitchesOf(solution);
  ASSERT_EQ(times.size(), 7u);
  for (std::size_t k = 0; k < times.size(); ++k) {
    EXPECT_NEAR(times[k], static_cast<double>(2 * k + 1) * std::numbers::sqrt2, 1e-12);
  }
}

// |x1| + |x2| falls with slope -2, through ever more switches: zero at t = 0.65, and sliding in both behind
// it.
TEST(RelaysTest, FollowsSwitchesThatAccumulateIntoSliding) {
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
TEST(RelaysTest, SurvivesWhereNoModeLasts) {
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

// x' = sign(s) with s = (t - 1)^p - 10^-k, which is negative for |t - 1| < 10^(-k/p). Where rounding of s hides how
// long, or whether it is so at all, the solution is not solved.
TEST(RelaysTest, CountsHowLongAnArgumentIsNearZero) {
  int solved = 0;
  for (const double tolerance : {1e-6, 1e-8}) {
    for (int p = 2; p <= 12; p += 2) {
      for (int k = 8; k <= 15; ++k) {
        Problem problem;
        problem.A = Matrix{{0}};
        problem.B = Matrix{{-1, 0}};
        problem.N = Matrix{{0}, {0}};
        problem.M = Matrix{{0, 1}, {-1, 0}};
        problem.f = TimeFunction::Constant(Vector{{1}});
        problem.g = TimeFunction::Formulas({"(t-1)^" + std::to_string(p) + "-1e-" + std::to_string(k), "2"});
        problem.x0 = Vector{{0}};
        problem.horizon = 2;
        const Solution solution = SolveAt(problem, tolerance, {2});
        if (JudgeSolution(solution).kind != VerdictKind::kSolved) continue;
        ++solved;
        const double exact = 2 - 4 * std::pow(10.0, -static_cast<double>(k) / p);
        EXPECT_LT(std::abs(LastState(solution)[0] - exact), tolerance * exact) << p << " " << k;
      }
    }
  }
  EXPECT_GE(solved, 40);
}

// An ulp of 1e15 is an eighth: so much the jumps may be off.
TEST(RelaysTest, CountsTheRoundingInsideTheArgumentOfAJump) {
  for (const double offset : {0.0, 1e6, 1e12, 1e15}) {
    const std::string number = FormatNumber(offset);
    const std::string jumps = "floor(2*t+" + number + ")-" + number;
    Problem by_f = Relays(Matrix{{0}}, Matrix{{0}}, Matrix{{0}}, Vector{{0}}, 4), by_g = by_f;
    by_f.f = TimeFunction::Formulas({jumps});
    by_g.B = Matrix{{1, 0}};
    by_g.M = Matrix{{1, 0}, {0, 1}};
    by_g.g = TimeFunction::Formulas({number + "-floor(2*t+" + number + ")", "1"});
    for (const Problem* problem : {&by_f, &by_g}) {
      const Solution solution = SolveAt(*problem, 1e-9, {4});
      const double error = std::abs(LastState(solution)[0] - 14);
      EXPECT_LE(error, solution.accuracy.error * 14) << offset;
      EXPECT_EQ(JudgeSolution(solution).kind == VerdictKind::kSolved, offset < 1e7) << offset;
    }
  }
}

// A fast state is off before it settles, where the time of a jump is not known. Within the rounding of times no node
// shows that.
TEST(RelaysTest, CountsFastStatesBesideAJumpOfUnknownTime) {
  for (const double offset : {0.0, 1e12}) {
    const std::string number = FormatNumber(offset);
    Problem problem = Relays(Matrix{{-1e5}}, Matrix{{0}}, Matrix{{0}}, Vector{{1}}, 1);
    problem.f = TimeFunction::Formulas({"floor(2*t+" + number + ")-" + number});
    const Solution solution = SolveAt(problem, 1e-7, {0.5, 1});
    const double error = solution.x(0, 0);  // x(0.5) = exp(-5e4)
    EXPECT_LE(error, solution.accuracy.errors.x.truncation[0] + solution.accuracy.errors.x.rounding[0]) << offset;
    EXPECT_EQ(JudgeSolution(solution).kind == VerdictKind::kSolved, offset == 0) << offset;
  }
}

}  // namespace
}  // namespace dlcs
