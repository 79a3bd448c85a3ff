// SPDX-License-Identifier: Apache-2.0
#include "core/methods/newton_step.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <string>

#include "core/analysis/newton_bounds.h"
#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

Options TimeSteppingBy(StepSolver step_solver, Index steps, double theta = 0) {
  Options options;
  options.method = Method::kTimeStepping;
  options.step_solver = step_solver;
  options.num_steps = steps;
  options.theta = theta;
  return options;
}

Solution SolveWith(const Problem& problem, const Options& options) {
  Observer silent;
  auto solution = Solve(problem, options, silent, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return solution.ok() ? *std::move(solution) : Solution{};
}

void ExpectAgreement(const Problem& problem, Index steps, double theta) {
  const Solution newton = SolveWith(problem, TimeSteppingBy(StepSolver::kNewton, steps, theta));
  const Solution substituted = SolveWith(problem, TimeSteppingBy(StepSolver::kSubstitution, steps, theta));
  ASSERT_EQ(newton.termination, Termination::kConverged) << newton.message;
  ASSERT_EQ(substituted.termination, Termination::kConverged) << substituted.message;
  EXPECT_EQ(newton.cost.substituted_steps, 0);
  EXPECT_GE(newton.cost.newton_iterations, 1);
  EXPECT_LT(MaxAbs(newton.x - substituted.x), 1e-10 * MaxAbs(substituted.x));
  EXPECT_LT(MaxAbs(problem.B * (newton.y - substituted.y)), 1e-10 * MaxAbs(problem.B * substituted.y));
}

class NewtonCasesTest : public ::testing::TestWithParam<const char*> {};

TEST_P(NewtonCasesTest, AgreesWithSubstitution) {
  const Problem problem = testing::LoadCase(GetParam()).problem;
  for (const double theta : {0.0, 0.5}) ExpectAgreement(problem, 4000, theta);
}

INSTANTIATE_TEST_SUITE_P(All, NewtonCasesTest,
                         ::testing::Values("rlcd", "abb_circuit_a", "observer_lcs", "saturated_pd", "wall_permeable",
                                           "leontief_stock", "train_brakes", "formula_zoo", "z_least"),
                         [](const auto& name) { return std::string(name.param); });

TEST(NewtonStepTest, AgreesWithSubstitutionOnTheExamplesOfThePapers) {
  for (const double theta : {0.0, 0.5, 1.0}) {
    ExpectAgreement(testing::ExampleFourOne(), 500, theta);
    ExpectAgreement(testing::FourVariableEasy(), 1000, theta);
  }
}

TEST(NewtonStepTest, ReproducesTheJacobianOfExampleFourOne) {
  const Problem problem = testing::ExampleFourOne();
  const double h = 1.0 / 25;  // < 1/(3κ) = 1/24
  const Matrix I = Matrix::Identity(2, 2);
  const Matrix R_inverse = I - h * problem.A;
  // y1 > 0 where x1 > 0: V = I - h diag(-α1 - α3, -α2) as printed; the same with y4 where x1 < 0.
  const Matrix printed = I - h * Vector{{-4, -2}}.asDiagonal().toDenseMatrix();
  for (const Index active : {0, 3}) {
    const Matrix V = R_inverse * NewtonMatrix(problem, ThetaScheme(problem, h, 0).y_after, {active});
    EXPECT_LT(MaxAbs(V - printed), 1e-15) << active;
  }
  const Matrix at_kink = R_inverse * NewtonMatrix(problem, ThetaScheme(problem, h, 0).y_after, {});
  EXPECT_LT(MaxAbs(at_kink - (I - h * problem.A)), 1e-15);
}

TEST(NewtonStepTest, ConvergesToTheClosedFormOfExampleFourOneWithOrderOne) {
  const Problem problem = testing::ExampleFourOne();
  double last = 0;
  for (const Index steps : {25, 100, 400, 1600}) {
    const Solution solution = SolveWith(problem, TimeSteppingBy(StepSolver::kNewton, steps));
    double error = 0;
    for (std::size_t k = 0; k < solution.times.size(); ++k) {
      const auto x = solution.x.col(static_cast<Index>(k));
      error = std::max(error, MaxAbs(x - testing::ExampleFourOneExact(solution.times[k])));
    }
    EXPECT_TRUE(solution.warnings.empty()) << solution.warnings.front();
    EXPECT_EQ(solution.cost.substituted_steps, 0);
    if (steps > 100) {
      EXPECT_NEAR(std::log2(last / error) / 2, 1, 0.1) << steps;
    }
    last = error;
  }
}

// x' = -2x - 10 - Σ b_i y_i, y_i = (x - k_i)⁺, from x = 1: the first step of length 1/10 ends at 0 and crosses all the kinks
// k_i = 4^{-i} that crowd there.
Problem CrowdedKinks() {
  constexpr Index n = 20;
  Problem problem;
  problem.A = Matrix::Constant(1, 1, -2);
  problem.B.resize(1, n);
  Vector kinks(n);
  for (Index i = 0; i < n; ++i) {
    problem.B(0, i) = -std::pow(2.0, -static_cast<double>(i));
    kinks[i] = std::pow(4.0, -static_cast<double>(i + 1));
  }
  problem.B /= problem.B.cwiseAbs().sum();  // κ = 2 + 1
  problem.N = -Matrix::Ones(n, 1);
  problem.M = Matrix::Identity(n, n);
  problem.f = TimeFunction::Constant(Vector::Constant(1, -10));
  problem.g = TimeFunction::Constant(kinks);
  problem.x0 = Vector::Ones(1);
  problem.horizon = 0.1;
  return problem;
}

// ‖H(u^{k+1}) - H(u^k)‖ / ‖u^{k+1} - u^k‖ of u^{k+1} = H(u^k), (3.1), at θ = 0 and for constant sources.
std::vector<double> ContractionQuotients(const Problem& problem, double h, int count) {
  const auto constant = [](const TimeFunction& function) {
    return std::get<ConstantFunction>(function.pieces.front().function).value;
  };
  const Vector f = constant(problem.f), g = constant(problem.g);
  const auto solver = MakeLcpSolver(problem.M, Selection::kUnique);
  Basis basis(problem.num_constraints(), 0);
  const Vector tolerance = Vector::Constant(problem.num_constraints(), 1e-14);
  const auto H = [&](const Vector& u) -> Vector {
    Vector y(problem.num_constraints());
    EXPECT_EQ(solver->Solve(problem.N * u + g, tolerance, basis, y), LcpVerdict::kSolved);
    return problem.x0 + h * (problem.A * u + problem.B * y + f);
  };
  std::vector<double> quotients;
  Vector u = problem.x0;
  Vector next = H(u);
  for (int k = 0; k < count; ++k) {
    const Vector after = H(next);
    quotients.push_back(MaxAbs(after - next) / MaxAbs(next - u));
    u = next;
    next = after;
  }
  return quotients;
}

TEST(NewtonStepTest, ConvergesSuperlinearlyWhereTheContractionIsLinear) {
  const Problem problem = CrowdedKinks();
  const Solution solution = SolveWith(problem, TimeSteppingBy(StepSolver::kNewton, 1));
  ASSERT_TRUE(solution.newton && solution.newton->contraction);
  EXPECT_DOUBLE_EQ(*solution.newton->contraction, 0.3);  // hκ < 1/3
  EXPECT_TRUE(solution.warnings.empty());
  const std::vector<double>& residuals = solution.newton->residuals;
  EXPECT_EQ(solution.newton->time, problem.horizon);
  EXPECT_EQ(solution.cost.most_newton_iterations, static_cast<Index>(residuals.size()) - 1);
  ASSERT_GE(residuals.size(), 5u);
  EXPECT_EQ(residuals.back(), 0);
  double last = 1;
  for (std::size_t k = 1; k < residuals.size(); ++k) {
    const double quotient = residuals[k] / residuals[k - 1];
    EXPECT_LT(quotient, last) << k;
    last = quotient;
  }
  for (const double quotient : ContractionQuotients(problem, problem.horizon, 12)) {
    EXPECT_LE(quotient, 0.3 + 1e-9);
    EXPECT_GE(quotient, 0.2 - 1e-9);
  }
}

// At a point where y has a kink, V is the derivative of F at points as near as one likes: it is in ∂F (Theorem 3.1).
TEST(NewtonStepTest, MatrixIsALimitOfDerivatives) {
  std::srand(5);
  constexpr Index n = 4, m = 5;
  for (int trial = 0; trial < 50; ++trial) {
    Problem problem;
    problem.A = Matrix::Random(m, m);
    problem.B = Matrix::Random(m, n);
    problem.N = Matrix::Random(n, m);
    problem.M = Matrix::Random(n, n);
    problem.M.diagonal().array() += n;  // a P-matrix
    const Scheme scheme = ThetaScheme(problem, 0.1, 0);
    // y = (+, +, 0, 0), w = (0, 0, 0, +): index 2 is degenerate.
    const Vector y{{1, 2, 0, 0}}, w{{0, 0, 0, 1}};
    const Vector u = Vector::Random(m);
    const Vector g = w - problem.M * y - problem.N * u;
    const auto solver = MakeLcpSolver(problem.M, Selection::kUnique);
    const auto F = [&](const Vector& at) -> Vector {
      Basis basis(n, 0);
      Vector solution(n);
      EXPECT_EQ(solver->Solve(problem.N * at + g, Vector::Constant(n, 1e-15), basis, solution), LcpVerdict::kSolved);
      return at - scheme.y_after * solution;
    };
    const Matrix V = NewtonMatrix(problem, scheme.y_after, {0, 1});
    const Vector into_the_piece =
        problem.N.completeOrthogonalDecomposition().solve(Vector{{0, 0, 1, 1}});  // (I - D)e
    for (const double distance : {1e-2, 1e-4}) {
      const Vector near = u + distance * into_the_piece;
      const double eps = distance * 1e-3;
      Matrix derivative(m, m);
      for (Index j = 0; j < m; ++j) {
        const Vector e = Vector::Unit(m, j) * eps;
        derivative.col(j) = (F(near + e) - F(near - e)) / (2 * eps);
      }
      EXPECT_LT(MaxAbs(derivative - V), 1e-8) << trial << " at " << distance;
    }
  }
}

TEST(NewtonStepTest, SolvesACycleBySubstitutionAndSaysSo) {
  // F(u) = u - p + hb[u⁺ - (u - 1)⁺] has slopes 1, 3, 1: with p = 1.5 and hb = 2 the iterates are 1.5, -0.5, 1.5, ...
  Problem problem;
  problem.A = Matrix::Zero(1, 1);
  problem.B = Matrix{{-2, 2}};
  problem.N = Matrix{{-1}, {-1}};
  problem.M = Matrix::Identity(2, 2);
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector{{0, 1}});
  problem.x0 = Vector::Constant(1, 1.5);
  problem.horizon = 1;
  const Solution solution = SolveWith(problem, TimeSteppingBy(StepSolver::kNewton, 1));
  EXPECT_EQ(solution.termination, Termination::kConverged) << solution.message;
  EXPECT_EQ(solution.cost.substituted_steps, 1);
  ASSERT_EQ(solution.warnings.size(), 2u);
  EXPECT_NE(solution.warnings[0].find("not guaranteed"), std::string::npos);
  EXPECT_NE(solution.warnings[1].find("by substitution"), std::string::npos);
  EXPECT_NEAR(solution.x(0, 1), 0.5, 1e-14);
}

TEST(NewtonStepTest, IsRefusedWhereYIsNoFunctionOfX) {
  for (const char* name : {"relay_sliding", "diode_bridge", "american_put"}) {
    const Solution solution =
        SolveWith(testing::LoadCase(name).problem, TimeSteppingBy(StepSolver::kNewton, 100));
    EXPECT_EQ(solution.termination, Termination::kUnsupported) << name;
    EXPECT_NE(solution.message.find("Newton"), std::string::npos) << solution.message;
  }
}

}  // namespace
}  // namespace dlcs
