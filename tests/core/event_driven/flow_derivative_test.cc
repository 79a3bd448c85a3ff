// SPDX-License-Identifier: Apache-2.0
// The derivative of the flow, judged by the exponential where the system is linear, and by differences of solves from
// other starts elsewhere.

#include <gtest/gtest.h>

#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>

#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

using testing::LoadCase;

Solution SolveFrom(Problem problem, const Vector& x0) {
  problem.x0 = x0;
  Options options;
  options.method = Method::kEventDriven;
  options.error_tolerance = 1e-11;
  options.keep_flow = true;
  options.project_initial_state = true;
  Observer silent;
  auto solution = Solve(problem, options, silent, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return solution.ok() ? *std::move(solution) : Solution{};
}

Vector EndOf(const Solution& solution) { return solution.x.rightCols(1); }

TEST(FlowDerivativeTest, IsTheExponentialWhereNothingSwitches) {
  Problem problem;
  Matrix A(3, 3);
  A << -1, 2, 0, -3, -0.5, 1, 0.5, 0, -4;
  problem.A = A;
  problem.B = Matrix::Zero(3, 1);
  problem.N = Matrix::Zero(1, 3);
  problem.M = Matrix::Identity(1, 1);
  problem.f = TimeFunction::Formulas({"sin(3*t)", "1", "t"});
  problem.g = TimeFunction::Constant(Vector::Ones(1));
  problem.x0 = Vector::Ones(3);
  problem.horizon = 2;
  const Solution solution = SolveFrom(problem, problem.x0);
  ASSERT_TRUE(solution.flow);
  EXPECT_LT(MaxAbs(solution.flow->derivative - Matrix((2 * A).exp())), 1e-12);
  EXPECT_LT(MaxAbs(solution.flow->begin_slope - (A * problem.x0 + Vector{{0, 1, 0}})), 1e-7);
  EXPECT_LT(MaxAbs(solution.flow->end_slope - (A * EndOf(solution) + Vector{{std::sin(6.0), 1, 2}})), 1e-7);
}

// At rest a step is as long as the horizon, in which disturbances oscillate up to 160 times, beside a stiff state. The
// exponential is that of the oscillation, in closed form; the stiff state follows x2 but for 1e-9 of its slope.
TEST(FlowDerivativeTest, IsTheExponentialWhereTheSolutionRests) {
  for (const double omega : {3.0, 20.0, 100.0, 1000.0}) {
    Problem problem;
    problem.A = Matrix{{-0.1, omega, 0}, {-omega, -0.1, 0}, {0, 1e9, -1e9}};
    problem.B = Matrix::Zero(3, 1);
    problem.N = Matrix::Zero(1, 3);
    problem.M = Matrix::Identity(1, 1);
    problem.f = TimeFunction::Constant(Vector{{0.1 - omega, omega + 0.1, 0}});
    problem.g = TimeFunction::Constant(Vector::Ones(1));
    problem.x0 = Vector::Ones(3);
    problem.horizon = 1;
    const Solution solution = SolveFrom(problem, problem.x0);
    ASSERT_TRUE(solution.flow);
    const double c = std::exp(-0.1) * std::cos(omega), s = std::exp(-0.1) * std::sin(omega);
    const Matrix exact{{c, s, 0}, {-s, c, 0}, {-s, c, 0}};
    EXPECT_LT(MaxAbs(solution.flow->derivative - exact), 2e-9 * omega) << omega;
    EXPECT_LT(MaxAbs((solution.flow->derivative - exact).topRows(2)), 1e-14 * omega + 1e-13) << omega;
    EXPECT_LT(solution.cost.steps, 20);
  }
}

// The same where a constraint with M = 0 holds a third state at zero: the equations of the mode are not explicit then.
TEST(FlowDerivativeTest, IsTheExponentialWhereAConstraintHoldsAState) {
  for (const double omega : {3.0, 20.0, 100.0}) {
    Problem problem;
    problem.A = Matrix{{-0.1, omega, 0}, {-omega, -0.1, 1}, {0, 0, 0}};
    problem.B = Matrix{{0}, {0}, {1}};
    problem.N = Matrix{{0, 0, 1}};
    problem.M = Matrix{{0}};
    problem.f = TimeFunction::Constant(Vector{{0.1 - omega, omega + 0.1, -1}});
    problem.g = TimeFunction::Zero(1);
    problem.x0 = Vector{{1, 1, 0}};
    problem.horizon = 1;
    const Solution solution = SolveFrom(problem, problem.x0);
    ASSERT_TRUE(solution.flow);
    const double c = std::exp(-0.1) * std::cos(omega), s = std::exp(-0.1) * std::sin(omega);
    const Matrix exact{{c, s, 0}, {-s, c, 0}, {0, 0, 0}};
    EXPECT_LT(MaxAbs(solution.flow->derivative - exact), 1e-14 * omega + 1e-13) << omega;
  }
}

class FlowDerivativeCasesTest : public ::testing::TestWithParam<const char*> {};

// At a point where the flow is smooth, a step so small that no event is added or lost.
TEST_P(FlowDerivativeCasesTest, IsTheDifferenceQuotient) {
  const Problem problem = LoadCase(GetParam()).problem;
  const Solution solution = SolveFrom(problem, problem.x0);
  ASSERT_TRUE(solution.flow);
  ASSERT_GT(solution.flow->derivative.size(), 0);
  const Vector size = solution.x.cwiseAbs().rowwise().maxCoeff();
  for (Index i = 0; i < problem.num_states(); ++i) {
    const double step = 1e-5 * size[i];
    const Vector unit = Vector::Unit(problem.num_states(), i);
    const Vector forward = EndOf(SolveFrom(problem, problem.x0 + step * unit));
    const Vector backward = EndOf(SolveFrom(problem, problem.x0 - step * unit));
    const Vector quotient = (forward - backward) / (2 * step);
    const Vector found = solution.flow->derivative.col(i);
    for (Index k = 0; k < quotient.size(); ++k) {
      EXPECT_NEAR(found[k] * size[i], quotient[k] * size[i], 2e-5 * size[k]) << "dx" << k << "/dx" << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, FlowDerivativeCasesTest,
                         ::testing::Values("rlcd", "abb_circuit_a", "observer_lcs", "saturated_pd", "leontief_stock",
                                           "diode_bridge", "diode_bridge_cap", "abb_circuit_c", "relay_sliding",
                                           "friction_oscillator"),
                         [](const auto& the_case) { return std::string(the_case.param); });

// w = (1 - t)^3 + v (1 - t) falls through zero with the speed v: for small v it touches zero first.
TEST(FlowDerivativeTest, NotesAnEventThatNearlyTouches) {
  for (const double v : {3e-6, 3e-7}) {
    Problem problem = testing::Scalar(0, 0, 1 + v, 2);
    problem.B = Matrix::Zero(1, 1);
    problem.f = TimeFunction::Formulas({"-3*(1 - t)^2 - " + FormatNumber(v)});
    const Solution solution = SolveFrom(problem, problem.x0);
    ASSERT_TRUE(solution.flow);
    EXPECT_EQ(solution.switching_times.size(), 2u);  // with the start
    EXPECT_EQ(solution.flow->grazes, v < 1e-6) << v;
  }
}

// 0 <= y ⟂ x - (1 while 1 < t < 2): x jumps to 1 at t = 1, whatever it was.
TEST(FlowDerivativeTest, AJumpForgetsTheStateBefore) {
  Problem problem;
  problem.A = Matrix{{-1, 0}, {0, -2}};
  problem.B = Matrix{{1}, {0.5}};
  problem.N = Matrix{{1, 0}};
  problem.M = Matrix::Zero(1, 1);
  problem.f = TimeFunction::Zero(2);
  problem.g = TimeFunction::Formulas({"-(1 < t)*(t < 2)"});
  problem.x0 = Vector{{0.5, 0.25}};
  problem.horizon = 3;
  const Solution solution = SolveFrom(problem, problem.x0);
  ASSERT_TRUE(solution.flow);
  ASSERT_EQ(solution.jumps.size(), 1u);
  // p = 1 - x1(1⁻) moves x2 by half of it.
  Matrix expected(2, 2);
  expected << 0, 0, -0.5 * std::exp(-1 - 2 * 2), std::exp(-2 * 3.0);
  EXPECT_LT(MaxAbs(solution.flow->derivative - expected), 1e-10);
}

}  // namespace
}  // namespace dlcs
