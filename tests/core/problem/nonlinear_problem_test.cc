// SPDX-License-Identifier: Apache-2.0
#include "core/problem/nonlinear_problem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/nonlinear/functions.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;

NonlinearProblem TwoStates() {
  NonlinearProblem problem;
  problem.f = {"sin(x2)*exp(-t)*y1**2", "x1/x2 - 3*y2"};
  problem.g = {"x1*x2 + y1**3 + y2 - t", "sqrt(y2) + 2*y1"};
  problem.x0 = Eigen::Vector2d(0.5, 2);
  problem.horizon = 1;
  return problem;
}

std::string ErrorOf(const std::string& text, FormulaVariables variables) {
  const auto formula = Formula::Parse(text, variables);
  return formula.ok() ? "accepted" : std::string(formula.status().message());
}

TEST(FormulaVariables, AreBoundByName) {
  auto formula = Formula::Parse("x2**2 - 10*y1 + t*x12", {12, 1});
  ASSERT_TRUE(formula.ok()) << formula.status();
  Vector x = Vector::Zero(12);
  x[1] = 3, x[11] = 0.5;
  EXPECT_EQ(formula->Evaluate(4, x, Vector::Constant(1, 0.25)), 9 - 2.5 + 2);
  EXPECT_EQ(formula->states(), (std::vector<Index>{1, 11}));
  EXPECT_EQ(formula->constraints(), std::vector<Index>{0});
  EXPECT_FALSE(Formula::Parse("x1 + 1", {1, 1})->DependsOnTime());
}

TEST(FormulaVariables, OutOfRangeAreExplained) {
  EXPECT_THAT(ErrorOf("2*x7", {3, 1}), HasSubstr("at position 3: x7: there are only 3 states"));
  EXPECT_THAT(ErrorOf("y2", {3, 1}), HasSubstr("y2: there is only 1 constraint"));
  EXPECT_THAT(ErrorOf("x0", {3, 1}), HasSubstr("states are counted from 1"));
  EXPECT_THAT(ErrorOf("y01", {3, 1}), HasSubstr("without leading zeros"));
  EXPECT_THAT(ErrorOf("x99999999999999999999", {3, 1}), HasSubstr("there are only 3 states"));
  EXPECT_THAT(ErrorOf("x1(3)", {3, 1}), HasSubstr("'x1' is not a function"));
  EXPECT_THAT(ErrorOf("foobar", {3, 2}), HasSubstr("the names are t x1 ... x3 y1 y2 pi e"));
  EXPECT_THAT(ErrorOf("x1", {}), HasSubstr("unknown name 'x1'"));
}

TEST(NonlinearProblem, TellsEveryBrokenRule) {
  NonlinearProblem problem = TwoStates();
  EXPECT_TRUE(Validate(problem).empty());
  problem.f = {"x3"};
  problem.g[1] = "y1 +";
  problem.horizon = -1;
  problem.break_points = {0.5, 0.25};
  problem.W = Matrix::Zero(2, 3);
  Options options;
  options.method = Method::kTimeStepping;
  const std::string message(CheckValid(problem, options).message());
  for (const char* part : {"f: 1 formulas; must be m = 2", "f[0]: at position 1: x3: there are only 2 states", "g[1]: ",
                           "T: -1; must be finite", "break_points[1]: ", "W: 2x3; must be m x m = 2x2", "method: "}) {
    EXPECT_THAT(message, HasSubstr(part));
  }
  problem = {};
  const std::string empty(CheckValid(problem, {}).message());
  EXPECT_THAT(empty, HasSubstr("g: no formulas"));
  EXPECT_THAT(empty, HasSubstr("x0: no components"));
}

TEST(NonlinearFunctions, JacobiansAreThoseOfTheFormulas) {
  auto functions = NonlinearFunctions::Create(TwoStates());
  ASSERT_TRUE(functions.ok());
  const double t = 0.3;
  const Vector x = Eigen::Vector2d(0.7, 1.9), y = Eigen::Vector2d(0.4, 0.09);
  EXPECT_EQ(functions->F(t, x, y)[1], 0.7 / 1.9 - 3 * 0.09);
  Matrix f_x(2, 2), f_y(2, 2), g_x(2, 2), g_y(2, 2);
  f_x << 0, std::cos(1.9) * std::exp(-t) * 0.16, 1 / 1.9, -0.7 / (1.9 * 1.9);
  f_y << 2 * 0.4 * std::sin(1.9) * std::exp(-t), 0, 0, -3;
  g_x << 1.9, 0.7, 0, 0;
  g_y << 3 * 0.16, 1, 2, 0.5 / 0.3;
  EXPECT_LT((functions->FByX(t, x, y) - f_x).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((functions->FByY(t, x, y) - f_y).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((functions->GByX(t, x, y) - g_x).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((functions->GByY(t, x, y) - g_y).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_EQ(functions->GByX(t, x, y)(1, 1), 0);
}

TEST(NonlinearFunctions, DifferencesStayInsideTheDomain) {
  auto functions = NonlinearFunctions::Create(TwoStates());
  ASSERT_TRUE(functions.ok());
  const Matrix at_zero = functions->GByY(0, Eigen::Vector2d(1, 1), Vector::Zero(2));  // sqrt(y2) has no left side
  EXPECT_TRUE(at_zero.allFinite());
  EXPECT_GT(at_zero(1, 1), 1);
}

TEST(NonlinearFunctions, SayWhichFormulaHasNoValue) {
  const Vector values = Eigen::Vector2d(1, std::nan(""));
  EXPECT_EQ(DescribeNonFinite("g", {"1", "log(x1)"}, values, 0.25), "g[1], \"log(x1)\", is nan at t = 0.25");
  EXPECT_EQ(DescribeNonFinite("g", {"1", "log(x1)"}, Vector::Ones(2), 0.25), "");
}

}  // namespace
}  // namespace dlcs
