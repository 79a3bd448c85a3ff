// SPDX-License-Identifier: Apache-2.0
// Modes whose y are large and nearly cancel in x', w and outputs, as the valves of closed switches are.

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <random>

#include "core/outputs/output_evaluator.h"
#include "core/problem/verdict.h"
#include "core/solve.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using Exact = boost::multiprecision::cpp_rational;

double Rounded(const Exact& value) { return static_cast<double>(value); }

// x' = -x + a (y2 - y1) + f, and both w are zero for ever; constant sources. The output is a (y2 - y1) + f.
struct ClosedSwitches {
  Problem problem;
  double x, output;  // at T
  Vector y;

  explicit ClosedSwitches(unsigned seed) {
    std::mt19937_64 random(seed);
    const auto between = [&random](double low, double high) {
      return low * std::pow(high / low, std::uniform_real_distribution<double>(0, 1)(random));
    };
    const double a = between(1e3, 1e6), r1 = between(0.01, 10), r2 = between(0.01, 10), current = between(10, 3000);
    problem.A = Matrix{{-1}};
    problem.B = Matrix{{-a, a}};
    problem.N = Matrix{{0}, {0}};
    problem.M = Matrix{{a + r1, -a}, {-a, a + r2}};
    const Vector g{{a * current - between(0.5, 50), -a * current - between(0.5, 50)}};
    problem.g = TimeFunction::Constant(g);
    problem.f = TimeFunction::Constant(Vector{{-a * current}});
    problem.x0 = Vector::Zero(1);
    problem.horizon = 5;
    problem.outputs.names = {"i"};
    problem.outputs.C = Matrix{{0}};
    problem.outputs.D = Matrix{{-a, a}};
    problem.outputs.h = TimeFunction::Constant(Vector{{-a * current}});
    const Matrix& M = problem.M.Dense();
    const Exact m11 = M(0, 0), m12 = M(0, 1), m21 = M(1, 0), m22 = M(1, 1), det = m11 * m22 - m12 * m21;
    const Exact y1 = (m12 * Exact(g[1]) - m22 * Exact(g[0])) / det, y2 = (m21 * Exact(g[0]) - m11 * Exact(g[1])) / det;
    y = Vector{{Rounded(y1), Rounded(y2)}};
    output = Rounded(Exact(a) * (y2 - y1) - Exact(a * current));
    x = -std::expm1(-problem.horizon) * output;
  }
};

// Of the terms of x' a millionth is left. What the data determine, to some ulps of each, is found: an inverse of M
// alone, however accurate, gives a (y2 - y1) to the rounding of a y.
TEST(ClosedSwitchesTest, DifferencesOfMultipliersHaveTheDigitsOfTheData) {
  int solved = 0, all = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    const ClosedSwitches exact(seed);
    if (!(exact.y.minCoeff() > 0)) continue;
    ++all;
    const Solution solution = testing::SolveWith(exact.problem, Options());
    const Verdict verdict = JudgeSolution(solution);
    if (verdict.kind != VerdictKind::kSolved) continue;
    ++solved;
    const ErrorsByCause& errors = solution.accuracy.errors.x;
    const auto expect_near = [&](double value, double right, const char* what) {
      EXPECT_LT(std::abs(value - right), solution.accuracy.tolerance * std::abs(right)) << what << " of seed " << seed;
    };
    const Index last = solution.x.cols() - 1;
    expect_near(solution.x(0, last), exact.x, "x");
    expect_near(solution.y(0, last), exact.y[0], "y1");
    expect_near(solution.y(1, last), exact.y[1], "y2");
    expect_near(OutputEvaluator::Create(exact.problem)->AtColumn(solution, last)[0], exact.output, "output");
    EXPECT_LT(std::abs(solution.x(0, last) - exact.x), 3 * (errors.truncation[0] + errors.rounding[0])) << seed;
  }
  EXPECT_GE(all, 50);
  EXPECT_GE(solved, all - 1);
}

}  // namespace
}  // namespace dlcs
