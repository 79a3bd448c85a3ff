// SPDX-License-Identifier: Apache-2.0
// Solves whose sources jump or have kinks inside their formulas.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "core/format_number.h"
#include "core/nonlinear/solve_nonlinear.h"
#include "core/problem/nonlinear_problem.h"
#include "core/problem/problem.h"
#include "core/solve.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::SolveToEnd;

Matrix One(double value) { return Matrix::Constant(1, 1, value); }

// x' = -x + f, and a pair that is not coupled to it.
Problem Scalar(const std::string& f, double horizon) {
  Problem problem;
  problem.A = One(-1);
  problem.B = One(0);
  problem.N = One(0);
  problem.M = One(1);
  problem.x0 = Vector::Zero(1);
  problem.f = TimeFunction::Formulas({f});
  problem.g = TimeFunction::Constant(Vector::Ones(1));
  problem.horizon = horizon;
  return problem;
}

struct Stepping {
  const char* name;
  Options options;
};

std::vector<Stepping> Methods(Index steps) {
  Options options;
  options.num_steps = steps;
  options.estimate_error = false;
  std::vector<Stepping> methods;
  for (const auto& [name, method] : {std::pair{"exponential-integrator", Method::kExponentialIntegrator},
                                     {"laplace-iteration", Method::kLaplaceIteration},
                                     {"time-stepping", Method::kTimeStepping},
                                     {"event-driven", Method::kEventDriven}}) {
    options.method = method;
    options.average_y = method == Method::kTimeStepping;
    methods.push_back({name, options});
    if (method == Method::kEventDriven) {
      methods.back().options.num_steps = 0;
      methods.back().options.error_tolerance = 1e-10;
    }
  }
  return methods;
}

// The rounding of the method where it is exact for constant sources, its order for the trapezoidal rule.
double ToleranceOf(const Stepping& stepping, double h) {
  if (stepping.options.method == Method::kTimeStepping) return h * h;
  return stepping.options.method == Method::kEventDriven ? 1e-10 : 1e-12;
}

TEST(FormulaJumpsTest, LosesNothingAtAJumpDeclaredOrNot) {
  for (const char* formula : {"(t < 1)*1", "(t <= 1)*1", "1 - (t >= 1)", "1 - (t > 1)", "(1 > t)*(t >= 0)",
                              "0.5 - 0.5*sign(t - 1)", "1 - min(1, floor(t))"}) {
    for (const bool declared : {false, true}) {
      Problem problem = Scalar(formula, 1.9);
      if (declared) problem.break_points = {1};
      for (const Stepping& stepping : Methods(100)) {
        const Solution solution = SolveToEnd(problem, stepping.options);
        const double right = (1 - std::exp(-1.0)) * std::exp(-0.9);
        EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), right, ToleranceOf(stepping, 0.02))
            << formula << ' ' << stepping.name << (declared ? " declared" : "");
      }
    }
  }
}

// A jump at a time that is no double: t > 0.1 + 0.2 in one formula, 0.3 in another, both declared nowhere or as 0.3.
TEST(FormulaJumpsTest, TakesTimesThatAgreeToRoundingForOne) {
  Problem problem = Scalar("(t > 0.1 + 0.2)*1 + (t > 0.3)*2", 1);
  problem.g = TimeFunction::Formulas({"1 + (t > 0.9/3)"});
  EXPECT_THAT(BreakPoints(problem), ::testing::SizeIs(1));
  problem.break_points = {0.3};
  EXPECT_THAT(BreakPoints(problem), ElementsAre(0.3));
  for (const Stepping& stepping : Methods(50)) {
    const Solution solution = SolveToEnd(problem, stepping.options);
    EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), 3 * (1 - std::exp(-0.7)), ToleranceOf(stepping, 0.05))
        << stepping.name;
  }
}

// x' = max(0, sin t) and abs(cos t), whose integrals are known.
TEST(FormulaJumpsTest, KeepsTheOrderAcrossKinks) {
  for (const auto& [formula, integral] :
       {std::pair{"max(0, sin(t))", 2 + (1 - std::cos(7 - 2 * M_PI))}, {"abs(cos(t))", 4 + std::sin(7 - 2 * M_PI)}}) {
    Problem problem = Scalar(formula, 7);
    problem.A = One(0);
    for (const Stepping& stepping : Methods(200)) {
      if (stepping.options.method != Method::kEventDriven) {
        double before = 0;
        for (const Index steps : {100, 200}) {
          Options options = stepping.options;
          options.num_steps = steps;
          const Solution solution = SolveToEnd(problem, options);
          const double error = std::abs(solution.x(0, solution.x.cols() - 1) - integral);
          if (steps == 200) {
            EXPECT_NEAR(before / error, 4, 0.3) << formula << ' ' << stepping.name;
          }
          before = error;
        }
        continue;
      }
      const Solution solution = SolveToEnd(problem, stepping.options);
      EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), integral, 1e-9) << formula;
      EXPECT_THAT(solution.warnings, IsEmpty()) << formula;
    }
  }
}

// Random systems with jumps in f and g agree with the same systems written as pieces.
TEST(FormulaJumpsTest, AgreesWithPieces) {
  std::mt19937_64 random(3);
  const auto number = [&] { return std::uniform_real_distribution<>(-1, 1)(random); };
  for (int trial = 0; trial < 12; ++trial) {
    const Index m = 3, n = 2;
    Problem problem;
    problem.x0.resize(m);
    const auto fill = [&](Index rows, Index columns) { return Matrix::NullaryExpr(rows, columns, number).eval(); };
    problem.A = fill(m, m);
    problem.B = fill(m, n);
    problem.N = fill(n, m);
    const Matrix root = fill(n, n);
    problem.M = Matrix(root * root.transpose() + Matrix::Identity(n, n));
    problem.x0 = fill(m, 1);
    problem.horizon = 3;
    const double at = std::round(1000 * (1.5 + number())) / 1000;
    const auto formulas = [&](Index size, std::vector<std::string>& before, std::vector<std::string>& behind) {
      std::vector<std::string> whole;
      for (Index i = 0; i < size; ++i) {
        before.push_back(NumberText(number()) + "*sin(3*t)");
        behind.push_back(NumberText(number()) + " + 0.3*t");
        whole.push_back("(t < " + NumberText(at) + ")*(" + before.back() + ") + (t >= " + NumberText(at) + ")*(" +
                        behind.back() + ")");
      }
      return TimeFunction::Formulas(whole);
    };
    std::vector<std::string> f_before, f_behind, g_before, g_behind;
    problem.f = formulas(m, f_before, f_behind);
    problem.g = formulas(n, g_before, g_behind);
    Problem pieces = problem;
    pieces.f = TimeFunction::Formulas(f_before);
    pieces.f.pieces.push_back({at, FormulaFunction{f_behind}});
    pieces.g = TimeFunction::Formulas(g_before);
    pieces.g.pieces.push_back({at, FormulaFunction{g_behind}});
    ASSERT_EQ(BreakPoints(problem), BreakPoints(pieces));
    for (const Stepping& stepping : Methods(150)) {
      const Solution solution = SolveToEnd(problem, stepping.options), same = SolveToEnd(pieces, stepping.options);
      ASSERT_EQ(solution.times, same.times) << stepping.name;
      EXPECT_LE((solution.x - same.x).cwiseAbs().maxCoeff(), 1e-12) << stepping.name;
      EXPECT_LE((solution.y - same.y).cwiseAbs().maxCoeff(), 1e-12) << stepping.name;
    }
  }
}

TEST(FormulaJumpsTest, FindsTheJumpsOfNonlinearProblems) {
  NonlinearProblem problem;
  problem.f = {"-x1 + a*(t <= 1) + 0*y1"};
  problem.g = {"y1 + 1"};
  problem.x0 = Vector::Zero(1);
  problem.horizon = 1.9;
  problem.parameters = {{"a", 1}};
  EXPECT_THAT(BreakPoints(problem), ElementsAre(1));
  Options options;
  options.num_steps = 100;
  Observer observer;
  const auto solution = SolveNonlinear(problem, options, observer, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_NEAR(solution->x(0, solution->x.cols() - 1), (1 - std::exp(-1.0)) * std::exp(-0.9), 1e-6);
}

TEST(FormulaJumpsTest, RefusesTooManyJumpsWithTheField) {
  Problem problem = Scalar("floor(1e7*t)", 1);
  const std::vector<Violation> violations = Validate(problem);
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].field, "f[0]");
  EXPECT_THAT(violations[0].description, HasSubstr("\"floor(1e7*t)\" switches more than 10000000 times"));
  problem.f = TimeFunction::Formulas({"floor(6e4*t)"});
  problem.g = TimeFunction::Formulas({"1 + ceil(6e4*t)"});
  EXPECT_THAT(Validate(problem), IsEmpty());  // the same times
  problem.g = TimeFunction::Formulas({"1 + ceil(5.9e4*t)"});
  ASSERT_EQ(Validate(problem).size(), 1u);
  EXPECT_THAT(Validate(problem)[0].description, HasSubstr("are allowed together"));
}

TEST(FormulaJumpsTest, ReadsParametersInSources) {
  Problem problem = Scalar("0", 2);
  problem.f.pieces[0].function = FormulaFunction{{"level*(t < switch_off)"}, {{"level", 3}, {"switch_off", 0.5}}};
  EXPECT_THAT(Validate(problem), IsEmpty());
  EXPECT_THAT(BreakPoints(problem), ElementsAre(0.5));
  Options options;
  options.num_steps = 64;
  const Solution solution = SolveToEnd(problem, options);
  EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), 3 * (1 - std::exp(-0.5)) * std::exp(-1.5), 1e-12);
}

TEST(FormulaJumpsTest, WarnsOfWhatCouldNotBeToldApart) {
  const Problem problem = Scalar("(t**2 - 2*t + 1 > 0)*1", 2);
  EXPECT_THAT(SourceWarnings(problem),
              ElementsAre(HasSubstr("Of f[0], \"(t**2 - 2*t + 1 > 0)*1\", switching times within")));
}

// Of a pulse of some ulps of t only rounded ends are known: what is unknown of its area is in the figure.
TEST(FormulaJumpsTest, TheRoundingOfSwitchingTimesCounts) {
  for (const auto& [f, horizon, area] : {std::tuple{"(abs(t-1000)<1e-10)*1e10", 2000.0, 2.0},
                                         {"(abs(t-0.75)<1e-12)*1e12", 1.0, 2.0},
                                         {"(abs(t-0.75)<1e-6)*1e6", 1.0, 2.0},
                                         {"(abs(t-0.75)<0.125)*8", 1.0, 2.0}}) {
    Problem problem = Scalar(f, horizon);
    problem.A = One(0);
    const Solution solution = SolveToEnd(problem, {});
    const double error = std::abs(solution.x(0, solution.x.cols() - 1) / area - 1);
    EXPECT_LE(error, 3 * solution.accuracy.error) << f;
    EXPECT_LE(solution.accuracy.error, 100 * error + 1e-12) << f;
  }
}

// The exponent is a whole number on both sides of a switching time, and on its rounding too.
TEST(FormulaJumpsTest, APowerOfARoundedNumberMayHaveANegativeBase) {
  for (const auto& [f, integral] :
       {std::pair{"(-1)**floor(3*t)", 1.0 / 3}, {"(-2)**floor(3*t)", (1 - 2 + 4 - 8 + 16 - 32 + 64) / 3.0}}) {
    Problem problem = Scalar(f, 7.0 / 3);
    problem.A = One(0);
    const Solution solution = SolveToEnd(problem, {});
    EXPECT_NEAR(solution.x(0, solution.x.cols() - 1), integral, 1e-12) << f;
  }
}

}  // namespace
}  // namespace dlcs
