// SPDX-License-Identifier: Apache-2.0
#include "core/nonlinear/solve_nonlinear.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/problem/verdict.h"
#include "core/solve.h"
#include "tests/support/cases.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;

Options Steps(Index num_steps) {
  Options options;
  options.num_steps = num_steps;
  return options;
}

Solution SolveWith(const NonlinearProblem& problem, const Options& options) {
  Observer observer;
  auto solution = SolveNonlinear(problem, options, observer, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return solution.ok() ? *solution : Solution{};
}

std::string Term(double coefficient, const std::string& variable) {
  return coefficient == 0 ? "" : " + (" + NumberText(coefficient) + ")*" + variable;
}

// A linear problem whose sources are formulas or constants, written out as formulas in t, x and y, with W = A.
NonlinearProblem WrittenOut(const Problem& linear) {
  const auto rows = [](const Matrix& of_x, const Matrix& of_y, const TimeFunction& source) {
    std::vector<std::string> texts;
    for (Index i = 0; i < of_x.rows(); ++i) {
      const auto* formulas = std::get_if<FormulaFunction>(&source.pieces[0].function);
      const auto* constant = std::get_if<ConstantFunction>(&source.pieces[0].function);
      std::string text = formulas ? formulas->formulas[i] : NumberText(constant->value[i]);
      for (Index j = 0; j < of_x.cols(); ++j) text += Term(of_x(i, j), "x" + std::to_string(j + 1));
      for (Index j = 0; j < of_y.cols(); ++j) text += Term(of_y(i, j), "y" + std::to_string(j + 1));
      texts.push_back(text);
    }
    return texts;
  };
  NonlinearProblem problem;
  problem.f = rows(linear.A, linear.B, linear.f);
  problem.g = rows(linear.N, linear.M, linear.g);
  problem.x0 = linear.x0;
  problem.horizon = linear.horizon;
  problem.W = linear.A;
  return problem;
}

void ExpectAgreement(const Problem& linear, Index num_steps) {
  Observer observer;
  Options options = Steps(num_steps);
  options.method = Method::kExponentialIntegrator;
  const auto marched = Solve(linear, options, observer, {});
  ASSERT_TRUE(marched.ok()) << marched.status();
  const Solution split = SolveWith(WrittenOut(linear), Steps(num_steps));
  ASSERT_EQ(split.termination, Termination::kReachedEnd) << split.message;
  EXPECT_LT(MaxAbs(split.x - marched->x), 1e-10);
  EXPECT_LT(MaxAbs(split.y - marched->y), 1e-9);
  EXPECT_LT(split.certificate.node_residual, 1e-9);
  EXPECT_NEAR(split.certificate.midpoint_residual, marched->certificate.midpoint_residual, 1e-9);
}

TEST(SolveNonlinear, AgreesWithSolveOnLinearSystems) {
  ExpectAgreement(testing::ExampleFourOne(), 200);    // least element
  ExpectAgreement(testing::FourVariableEasy(), 128);  // least element, coupled states
  ExpectAgreement(testing::Scalar(-2, -1, 0.25, 2), 100);
  ExpectAgreement(testing::LoadCase("z_least").problem, 200);
  for (const char* name : {"formula_zoo", "leontief_stock", "wall_permeable"}) {  // P-matrices
    SCOPED_TRACE(name);
    ExpectAgreement(testing::LoadCase(name).problem, 400);
  }
}

// Logistic growth, harvested by what exceeds 1/2: y = (x - 1/2)⁺, written as the root of an increasing cubic.
NonlinearProblem Harvest() {
  NonlinearProblem problem;
  problem.f = {"x1*(1 - x1) - y1"};
  problem.g = {"y1 + y1**3 - (x1 - 0.5) - (x1 - 0.5)**3"};
  problem.x0 = Vector::Constant(1, 0.1);
  problem.horizon = 4;
  return problem;
}

double HarvestExact(double t) {
  const double root = std::sqrt(0.5), reached = std::log(9.0);  // x = 1/2
  if (t <= reached) return 1 / (1 + 9 * std::exp(-t));
  return root * std::tanh(root * (t - reached) + std::atanh(0.5 / root));
}

double HarvestError(const Solution& solution) {
  double error = 0;
  for (size_t k = 0; k < solution.times.size(); ++k) {
    error = NanMax(error, std::abs(solution.x(0, static_cast<Index>(k)) - HarvestExact(solution.times[k])));
  }
  return error;
}

TEST(SolveNonlinear, IsOfSecondOrderForEveryW) {
  for (const std::optional<Matrix>& W : {std::optional<Matrix>(), std::optional<Matrix>(Matrix::Zero(1, 1)),
                                         std::optional<Matrix>(Matrix::Constant(1, 1, -1))}) {
    NonlinearProblem problem = Harvest();
    problem.W = W;
    const Solution anywhere = SolveWith(problem, Steps(400));
    EXPECT_LT(HarvestError(anywhere), 2e-5) << "with the kink of y inside a step";
    problem.break_points = {std::log(9.0)};  // where x = 1/2: the constant of the error no longer depends on its place
    const Solution coarse = SolveWith(problem, Steps(100)), fine = SolveWith(problem, Steps(400));
    ASSERT_EQ(coarse.termination, Termination::kReachedEnd) << coarse.message;
    ASSERT_EQ(fine.termination, Termination::kReachedEnd) << fine.message;
    EXPECT_NEAR(HarvestError(coarse) / HarvestError(fine), 16, 1);
    EXPECT_LT(fine.certificate.node_residual, 1e-10);
    EXPECT_LT(fine.certificate.ode_defect, 1e-3);
    EXPECT_NEAR(fine.y(0, fine.y.cols() - 1), HarvestExact(4) - 0.5, 2e-5);
  }
}

TEST(SolveNonlinear, EstimatesItsError) {
  Options options = Steps(200);
  options.estimate_error = true;
  const Solution solution = SolveWith(Harvest(), options);
  const double relative = HarvestError(solution) / solution.certificate.x_scale;
  EXPECT_GT(solution.accuracy.error, relative / 3);
  EXPECT_LT(solution.accuracy.error, 30 * relative);
}

TEST(SolveNonlinear, KeepsTheErrorThatIsAskedFor) {
  for (const double tolerance : {1e-3, 1e-5, 0.0}) {
    Options options;
    options.error_tolerance = tolerance;
    const Solution solution = SolveWith(Harvest(), options);
    ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
    EXPECT_EQ(solution.accuracy.tolerance, tolerance > 0 ? tolerance : Options::kDefaultErrorTolerance);
    EXPECT_LE(HarvestError(solution) / solution.certificate.x_scale, solution.accuracy.tolerance);
    EXPECT_EQ(JudgeSolution(solution).kind, VerdictKind::kSolved);
  }
}

// Van der Pol's oscillator against a stop at x1 = 1 that yields like a hardening spring; the second opinion is Runge
// and Kutta's method with y from its own scalar equation.
TEST(SolveNonlinear, AgreesWithRungeKuttaOnAnOscillatorWithAStop) {
  NonlinearProblem problem;
  problem.f = {"x2", "(1 - x1**2)*x2 - x1 - y1"};
  problem.g = {"y1 + 0.05*y1**3 - 10*(x1 - 1)"};
  problem.x0 = Vector{{0.5, 0}};
  problem.horizon = 10;
  const auto stop = [](double x1) {
    double y = 0;
    for (int k = 0; x1 > 1 && k < 50; ++k) y -= (y + 0.05 * y * y * y - 10 * (x1 - 1)) / (1 + 0.15 * y * y);
    return y;
  };
  const auto slope = [&](const Eigen::Vector2d& x) {
    return Eigen::Vector2d(x[1], (1 - x[0] * x[0]) * x[1] - x[0] - stop(x[0]));
  };
  Eigen::Vector2d x = problem.x0;
  const int steps = 20000;
  const double h = problem.horizon / steps;
  for (int k = 0; k < steps; ++k) {
    const Eigen::Vector2d k1 = slope(x), k2 = slope(x + h / 2 * k1), k3 = slope(x + h / 2 * k2), k4 = slope(x + h * k3);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  const Solution coarse = SolveWith(problem, Steps(1000)), fine = SolveWith(problem, Steps(4000));
  ASSERT_EQ(fine.termination, Termination::kReachedEnd) << fine.message;
  EXPECT_GT(fine.y.maxCoeff(), 0.5) << "the stop is reached";
  const double error_coarse = MaxAbs(coarse.x.col(1000) - x), error_fine = MaxAbs(fine.x.col(4000) - x);
  EXPECT_LT(error_fine, 1e-4);
  EXPECT_GT(error_coarse / error_fine, 10) << error_coarse << " " << error_fine;
}

struct Changes final : Observer {
  void OnIterate(const IterateReport& report, const IterateValues&) override { changes.push_back(report.change); }
  std::vector<double> changes;
};

TEST(SolveNonlinear, ConvergesSuperlinearlyOnAWindow) {
  NonlinearProblem problem = Harvest();
  problem.W = Matrix::Zero(1, 1);
  Options options = Steps(200);
  options.window_steps = Options::kWholeHorizon;
  Changes observer;
  const auto solution = SolveNonlinear(problem, options, observer, {});
  ASSERT_TRUE(solution.ok());
  ASSERT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
  const std::vector<double>& c = observer.changes;
  ASSERT_GT(c.size(), 10u);
  // Contraction over the first and the last third, as geometric means: single ones jump where y switches.
  const size_t third = c.size() / 3, last = c.size() - 1;
  EXPECT_LT(c[last] / c[last - third], std::pow(0.5, third) * c[third] / c[0]);
  // The law of Picard, (Λ T)^k / k!, with |d/dx f(x, y(x))| <= 2 √½ < Λ = 1.5 between 0.1 and √½.
  for (size_t k = 0; k < c.size(); ++k) {
    const double order = static_cast<double>(k);
    EXPECT_LE(std::log(c[k] / c[0]), order * std::log(1.5 * problem.horizon) - std::lgamma(order + 1)) << k;
  }
}

TEST(SolveNonlinear, HasTheSameBitsForAnyNumberOfThreads) {
  NonlinearProblem problem = Harvest();
  Options one = Steps(500), four = Steps(500);
  one.num_threads = 1, four.num_threads = 4;
  const Solution a = SolveWith(problem, one), b = SolveWith(problem, four);
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.cost.lcps, b.cost.lcps);
}

// x' = -1000 (x - cos t) - y with W = 0 does not contract on a step of 1/50; the step is the trapezoidal rule.
TEST(SolveNonlinear, SolvesAStepTogetherWhereTheSplittingDoesNotContract) {
  NonlinearProblem problem;
  problem.f = {"-1000*(x1 - cos(t)) - sin(t) - y1"};
  problem.g = {"y1 + y1**2 - (x1 - 2)"};  // y = 0 on the solution x = cos t
  problem.x0 = Vector::Ones(1);
  problem.horizon = 1;
  problem.W = Matrix::Zero(1, 1);
  const Solution picard = SolveWith(problem, Steps(50));
  ASSERT_EQ(picard.termination, Termination::kReachedEnd) << picard.message;
  EXPECT_EQ(picard.cost.coupled_steps, 50);
  EXPECT_NEAR(picard.x(0, 50), std::cos(1), 1e-6);
  problem.W.reset();
  const Solution automatic = SolveWith(problem, Steps(50));
  EXPECT_EQ(automatic.cost.coupled_steps, 0);
  EXPECT_NEAR(automatic.x(0, 50), std::cos(1), 1e-3);
  EXPECT_THAT(automatic.reason, HasSubstr("W from the Jacobians"));
}

TEST(SolveNonlinear, TakesLimitsAtBreakPoints) {
  NonlinearProblem problem;
  problem.f = {"(t < 0.3) - 2*(t >= 0.3) + y1"};
  problem.g = {"y1 + exp(y1) - 1 + 1*(t >= 0.3)"};
  problem.x0 = Vector::Zero(1);
  problem.horizon = 1;
  problem.break_points = {0.3};
  const Solution solution = SolveWith(problem, Steps(10));
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), 0.3 - 1.4, 1e-12);
}

TEST(SolveNonlinear, SaysWhichFormulaHasNoValueAndWhen) {
  NonlinearProblem problem = Harvest();
  problem.f = {"log(1 - t) - y1"};
  const Solution solution = SolveWith(problem, Steps(100));
  EXPECT_EQ(solution.termination, Termination::kNonFinite);
  EXPECT_THAT(solution.message, HasSubstr("f[0], \"log(1 - t) - y1\""));
  EXPECT_NEAR(solution.failure_time, 1, 0.05);
  ASSERT_FALSE(solution.times.empty());
  EXPECT_GT(solution.times.back(), 0.9);
  EXPECT_TRUE(solution.x.allFinite());
}

TEST(SolveNonlinear, EndsWhereThereIsNoY) {
  NonlinearProblem problem;
  problem.f = {"-1"};
  problem.g = {"x1 - y1 - y1**3"};  // a solution, y = 0, as long as x >= 0
  problem.x0 = Vector::Constant(1, 0.505);
  problem.horizon = 1;
  const Solution solution = SolveWith(problem, Steps(100));
  EXPECT_EQ(solution.termination, Termination::kInfeasible) << solution.message;
  EXPECT_NEAR(solution.failure_time, 0.51, 1e-9);
  EXPECT_NEAR(solution.times.back(), 0.5, 1e-9);
}

TEST(SolveNonlinear, EndsAtAPole) {
  NonlinearProblem problem = Harvest();
  problem.f = {"x1**2"};
  problem.x0 = Vector::Ones(1);  // x = 1/(1 - t)
  const Solution solution = SolveWith(problem, Steps(400));
  EXPECT_NE(solution.termination, Termination::kReachedEnd);
  EXPECT_NEAR(solution.failure_time, 1, 0.05) << solution.message;
}

// x' = c x^p from 1: x is infinite at t = 1/(c (p - 1)).
TEST(SolveNonlinear, NamesABlowUp) {
  struct Growth {
    std::string f;
    double end;
  };
  for (const Growth& growth :
       {Growth{"x1**2", 1}, {"4*x1**1.5", 0.5}, {"x1**3 + y1", 0.5}, {"0.5*(1+x1**2)", 1.5708}}) {
    for (const Options& options : {Options(), Steps(400)}) {
      NonlinearProblem problem;
      problem.f = {growth.f};
      problem.g = {"1 + y1"};
      problem.x0 = Vector::Ones(1);
      problem.horizon = 2;
      const Solution solution = SolveWith(problem, options);
      EXPECT_EQ(solution.termination, Termination::kNonFinite) << growth.f;
      EXPECT_THAT(solution.message, HasSubstr("x1 grows without bound near t = ")) << growth.f;
      EXPECT_NEAR(solution.failure_time, growth.end, 0.02) << growth.f;
    }
  }
}

// A jump of f where x rests on it: no step gets past it, and neither the LCP nor growth is to blame.
TEST(SolveNonlinear, DoesNotBlameTheLcpForAJumpOfF) {
  NonlinearProblem problem;
  problem.f = {"-sign(x1)"};
  problem.g = {"1 + y1"};
  problem.x0 = Vector::Ones(1);
  problem.horizon = 4;
  const Solution solution = SolveWith(problem, Options());
  EXPECT_EQ(solution.termination, Termination::kIterationLimit);
  EXPECT_THAT(solution.message, HasSubstr("f may jump there"));
  EXPECT_EQ(solution.message.find("⟂"), std::string::npos) << solution.message;
  EXPECT_EQ(solution.message.find("without bound"), std::string::npos) << solution.message;
}

// e^{40 t} is large, but ends nowhere.
TEST(SolveNonlinear, DoesNotCallExponentialGrowthABlowUp) {
  NonlinearProblem problem;
  problem.f = {"40*x1"};
  problem.g = {"x1 - y1 - y1**3"};  // without a solution from x1 < 0 on
  problem.x0 = Vector::Constant(1, -1e-3);
  problem.horizon = 20;
  const Solution solution = SolveWith(problem, Steps(100));
  EXPECT_EQ(solution.message.find("without bound"), std::string::npos) << solution.message;
}

TEST(SolveNonlinear, RefusesWhatTheSplittingCannotDetermine) {
  NonlinearProblem problem = Harvest();
  problem.g = {"x1 - 0.5"};
  const Solution solution = SolveWith(problem, Steps(10));
  EXPECT_EQ(solution.termination, Termination::kUnsupported);
  EXPECT_THAT(solution.message, HasSubstr("y1 occurs in no formula of g"));
}

// All grids of up to 8192 steps see the constant 5.
TEST(SolveNonlinear, DoesNotBelieveStepsThatSeeASourceAtOnePhase) {
  NonlinearProblem problem;
  problem.f = {"-x1 + y1 + 5*cos(2*pi*4096*t)^2"};
  problem.g = {"x1 + y1 - 1"};
  problem.x0 = Vector::Zero(1);
  problem.horizon = 1;
  for (const Options& options : {Options(), Steps(1024)}) {
    const Verdict verdict = JudgeSolution(SolveWith(problem, options));
    EXPECT_FALSE(verdict.success) << verdict.text;
  }
}

TEST(SolveNonlinear, RecommendsNoMethodThatSolvesLinearProblemsOnly) {
  NonlinearProblem problem = Harvest();
  problem.f = {"-x1**3 + y1 + sin(20*t)"};
  Options options;
  options.error_tolerance = 1e-13;
  const Solution solution = SolveWith(problem, options);
  EXPECT_FALSE(JudgeSolution(solution).success) << solution.message;
  EXPECT_THAT(solution.message, HasSubstr("Allow a larger error"));
  EXPECT_EQ(solution.message.find("event-driven"), std::string::npos) << solution.message;
}

TEST(SolveNonlinear, StopsOnRequest) {
  std::stop_source source;
  source.request_stop();
  Observer observer;
  const auto solution = SolveNonlinear(Harvest(), Steps(100), observer, source.get_token());
  ASSERT_TRUE(solution.ok());
  EXPECT_EQ(solution->termination, Termination::kCancelled);
}

TEST(SolveNonlinear, ReportsAFixedWindowThatDiverges) {
  NonlinearProblem problem = Harvest();
  problem.f = {"20*x1**2 - x1**3 - y1"};
  problem.x0 = Vector::Ones(1);
  problem.W = Matrix::Zero(1, 1);
  Options options = Steps(400);
  options.window_steps = Options::kWholeHorizon;
  const Solution solution = SolveWith(problem, options);
  EXPECT_NE(solution.termination, Termination::kReachedEnd);
  EXPECT_THAT(solution.message, HasSubstr("Automatic windows would shrink it"));
  options.window_steps = 0;
  EXPECT_EQ(SolveWith(problem, options).termination, Termination::kReachedEnd);
}

}  // namespace
}  // namespace dlcs
