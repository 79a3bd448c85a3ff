// SPDX-License-Identifier: Apache-2.0
// States at the edge of consistency, at 0 and at break points: rounding is none, and what is more is found.

#include "core/context/consistency.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/solve.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

// x' = f + y, 0 <= y ⟂ x + g >= 0.
Problem Queue(const std::string& f, const std::string& g, double x0) {
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = problem.N = Matrix(Matrix::Ones(1, 1));
  problem.M = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Formulas({f});
  problem.g = TimeFunction::Formulas({g});
  problem.x0 = Vector::Constant(1, x0);
  problem.horizon = 1;
  return problem;
}

std::vector<Options> EveryWay() {
  Options events, march, stepping;
  events.method = Method::kEventDriven;
  events.error_tolerance = 1e-9;
  march.method = Method::kExponentialIntegrator;
  march.num_steps = 100;
  stepping.method = Method::kTimeStepping;
  stepping.num_steps = 100;
  return {events, march, stepping};
}

double LastOf(const Solution& solution) { return solution.x(0, solution.x.cols() - 1); }

TEST(ConsistencyTest, AnEmptyQueueMayBeginToFillAtZero) {
  for (const std::string g : {"-t", "-sin(t)", "-1.5*t+t*t"}) {
    for (const Options& options : EveryWay()) {
      const Solution solution = testing::SolveWith(Queue("2", g, 0), options);
      ASSERT_EQ(solution.termination, Termination::kReachedEnd) << g << ": " << solution.message;
      EXPECT_NEAR(LastOf(solution), 2, 1e-12) << g;
      EXPECT_TRUE(solution.jumps.empty());
    }
  }
}

// M = 0 and M skew in two pairs, states at zero: nothing that rounding does to g(0) asks for a jump.
TEST(ConsistencyTest, RoundingOfGIsConsistent) {
  for (const std::string g : {"-sin(t+pi)", "sin(t+2*pi)", "cos(t+pi/2)+2*t", "1e-30-t+2*t", "1e8*sin(t+4*pi)"}) {
    Problem skew = Queue("0", g, 0);
    skew.B = Matrix{{1, 0}};
    skew.N = Matrix{{1}, {0}};
    skew.M = Matrix{{0, -1}, {1, 0}};
    skew.g = TimeFunction::Formulas({g, "0"});
    for (const Options& options : EveryWay()) {
      for (const Problem& problem : {Queue("0", g, 0), skew}) {
        const Solution solution = testing::SolveWith(problem, options);
        EXPECT_EQ(solution.termination, Termination::kReachedEnd) << g << ": " << solution.message;
      }
    }
  }
}

TEST(ConsistencyTest, RoundingAtABreakPointIsConsistent) {
  Problem problem = Queue("0", "-sin(pi*t)", 0);
  problem.g.pieces = {{0, FormulaFunction{{"1-t"}}}, {1, FormulaFunction{{"-sin(pi*t)"}}}};
  problem.horizon = 2;
  for (const Options& options : EveryWay()) {
    const Solution solution = testing::SolveWith(problem, options);
    EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  }
}

// The row is as large as its terms over the solve, in whatever unit: what is 1e-10 of it is no rounding.
TEST(ConsistencyTest, WhatIsMoreThanRoundingIsInconsistentInEveryUnit) {
  for (const double unit : {1e-200, 1e-20, 1.0, 1e20, 1e200}) {
    Problem problem = Queue(
        "0",
        "(cos(t)-1-1e-10)*" + std::to_string(1) + "e" + std::to_string(static_cast<int>(std::round(std::log10(unit)))),
        0);
    problem.N = Matrix::Constant(1, 1, unit);
    for (const Options& options : EveryWay()) {
      const Solution solution = testing::SolveWith(problem, options);
      EXPECT_EQ(solution.termination, Termination::kInconsistentState) << unit;
      EXPECT_EQ(solution.failure_time, 0);
    }
  }
}

TEST(ConsistencyTest, SpeaksOfTheStateAtTheTimeThatItIsInconsistentAt) {
  Problem problem = Queue("0", "", 0);
  problem.g.pieces = {{0, FormulaFunction{{"1"}}}, {0.5, FormulaFunction{{"-1"}}}};
  Options options = EveryWay()[0];
  const Solution refused = testing::SolveWith(problem, options);
  EXPECT_EQ(refused.termination, Termination::kInconsistentState);
  EXPECT_EQ(refused.failure_time, 0.5);
  EXPECT_EQ(refused.message.find("initial state to"), std::string::npos) << refused.message;
  EXPECT_NE(refused.message.find("at t = 0.5"), std::string::npos) << refused.message;
  options.project_initial_state = true;
  const Solution projected = testing::SolveWith(problem, options);
  ASSERT_EQ(projected.jumps.size(), 1u);
  EXPECT_DOUBLE_EQ(projected.jumps[0].dx[0], 1);
}

// LCP(q, M) has a solution, y_3 = q_2 / 3 with q = (0, -q_2, q_3): a jump of zero is none.
TEST(ConsistencyTest, AJumpOfZeroIsNone) {
  Problem problem;
  problem.A = Matrix{{0, -1}, {1, 0}};
  problem.B = Matrix{{0, 0, 0.5}, {1.5, -1, 0.5}};
  problem.N = problem.B.Dense().transpose();
  problem.M = Matrix{{0, 0, 0}, {0, 0, 3}, {0, -3, 0}};
  problem.f = TimeFunction::Zero(2);
  problem.x0 = Vector::Zero(2);
  problem.horizon = 0.01;
  for (const std::string g : {"0", "1e-17", "-1e-17", "1"}) {
    problem.g = TimeFunction::Formulas({g + "+2*t", "-0.06+t", "1.2"});
    for (const Options& options : EveryWay()) {
      const Solution solution = testing::SolveWith(problem, options);
      EXPECT_EQ(solution.termination, Termination::kReachedEnd) << g << ": " << solution.message;
      EXPECT_TRUE(solution.jumps.empty());
    }
  }
}

}  // namespace
}  // namespace dlcs
