// SPDX-License-Identifier: Apache-2.0
#include "core/problem/formula_majorant.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <ostream>
#include <string>
#include <vector>

#include "core/problem/formula_syntax.h"

namespace dlcs {
namespace {

double ValueOfTree(const FormulaTree& tree, double t) {
  std::vector<double> values;
  for (const FormulaStep& step : tree.steps) {
    const auto value = [&](int of) { return of < 0 ? 0 : values[static_cast<std::size_t>(of)]; };
    values.push_back(step.operation == FormulaOperation::kNumber ? step.number
                     : step.operation == FormulaOperation::kTime
                         ? t
                         : ValueOf(step.operation, value(step.a), value(step.b)));
  }
  return values.back();
}

struct Interpolated {
  double error = 0;  // the largest, at many points
  double size = 0;   // the largest value
};

// By the polynomial of degree `points` - 1 through the values at the Chebyshev points of [lo, hi].
Interpolated Interpolate(const FormulaTree& tree, double lo, double hi, int points) {
  const auto time = [&](double s) { return lo + (hi - lo) * (1 + s) / 2; };
  std::vector<double> nodes, weights, values;
  for (int k = 0; k < points; ++k) {
    const double angle = std::numbers::pi * (2 * k + 1) / (2 * points);
    nodes.push_back(std::cos(angle));
    weights.push_back((k % 2 == 0 ? 1 : -1) * std::sin(angle));
    values.push_back(ValueOfTree(tree, time(nodes.back())));
  }
  Interpolated result;
  for (int j = 0; j <= 100; ++j) {
    const double s = -1 + 2 * (j + 0.37) / 101.0;
    double above = 0, below = 0;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      above += weights[k] / (s - nodes[k]) * values[k];
      below += weights[k] / (s - nodes[k]);
    }
    const double value = ValueOfTree(tree, time(s));
    result.error = std::max(result.error, std::abs(value - above / below));
    result.size = std::max(result.size, std::abs(value));
  }
  return result;
}

struct FormulaOnInterval {
  const char* formula;
  double lo, hi;
};

void PrintTo(const FormulaOnInterval& c, std::ostream* out) {
  *out << c.formula << " on [" << c.lo << ", " << c.hi << "]";
}

class FormulaMajorantTest : public ::testing::TestWithParam<FormulaOnInterval> {};

// No interpolant is farther from the formula than its bound, whatever its degree. And the last one that is above
// rounding would not be nearer than its bound on an interval twice as long.
TEST_P(FormulaMajorantTest, BoundsTheErrorOfInterpolation) {
  const FormulaOnInterval& c = GetParam();
  const absl::StatusOr<FormulaTree> tree = ReadFormula(c.formula);
  ASSERT_TRUE(tree.ok()) << tree.status();
  FormulaMajorant majorant(*tree);
  majorant.Evaluate(c.lo, c.hi);
  double bound_of_twice = 0;  // over the error
  for (int points = 1; points <= TaylorBounds::kOrder; ++points) {
    const Interpolated seen = Interpolate(*tree, c.lo, c.hi, points);
    const double bound = std::ldexp(majorant.bounds()[points], 1 - points);
    const double rounding = 1e-14 * seen.size;
    EXPECT_LE(seen.error, bound + rounding) << "degree " << points - 1;
    if (seen.error > 1e3 * rounding) bound_of_twice = std::ldexp(bound, -points) / seen.error;
  }
  EXPECT_LE(bound_of_twice, 1);
}

std::string NameOfFormula(const ::testing::TestParamInfo<FormulaOnInterval>& info) {
  std::string name;
  for (const char* c = info.param.formula; *c != 0; ++c) {
    if (std::isalnum(static_cast<unsigned char>(*c)) != 0) name += *c;
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(
    Formulas, FormulaMajorantTest,
    ::testing::Values(FormulaOnInterval{"sin(3*t)", 0, 2}, FormulaOnInterval{"cos(40*t + 1)", 0.1, 0.15},
                      FormulaOnInterval{"exp(-t)*cos(2*t)", 0.5, 1.5},
                      FormulaOnInterval{"exp(-50*(t - 0.3)**2)", 0.2, 0.4}, FormulaOnInterval{"cos(t)**200", -0.1, 0.1},
                      FormulaOnInterval{"cos(t)**7", 1.4, 1.8}, FormulaOnInterval{"1/(1 + t)", 0, 0.5},
                      FormulaOnInterval{"t/(1 + t*t)", 0, 0.5}, FormulaOnInterval{"sqrt(1 + t)", 0, 0.5},
                      FormulaOnInterval{"(2 + t)**-1.5", 0, 1}, FormulaOnInterval{"(1 + t)**sin(t)", 0.1, 0.4},
                      FormulaOnInterval{"log(1 + t)", 0.2, 0.6}, FormulaOnInterval{"log10(3 + cos(t))", 0.2, 0.6},
                      FormulaOnInterval{"atan(3*t)", 0.1, 0.2}, FormulaOnInterval{"asin(t)", 0.1, 0.4},
                      FormulaOnInterval{"acos(t/2)", -0.4, 0.4}, FormulaOnInterval{"tan(t)", 0.3, 0.7},
                      FormulaOnInterval{"tanh(2*t)", 0.3, 0.7}, FormulaOnInterval{"sinh(t) - cosh(t/3)", 0, 1},
                      FormulaOnInterval{"max(t, sin(t) + 3)", 0, 1}, FormulaOnInterval{"abs(t - 3)*exp(t)", 0, 1},
                      FormulaOnInterval{"floor(t)*exp(t) + (t < 5)", 1, 1.9},
                      FormulaOnInterval{"t**5 - 3*t**3 + 1", -1, 1}),
    NameOfFormula);

TEST(FormulaMajorantTest, IsNotFiniteWhereThereIsNoDerivative) {
  for (const char* formula : {"sqrt(t)", "1/t", "log(t)", "t**0.5", "asin(1 - t)", "sqrt(1 - cos(t))"}) {
    const absl::StatusOr<FormulaTree> tree = ReadFormula(formula);
    ASSERT_TRUE(tree.ok()) << tree.status();
    FormulaMajorant majorant(*tree);
    majorant.Evaluate(0, 0.5);
    EXPECT_FALSE(std::isfinite(majorant.bounds()[TaylorBounds::kOrder])) << formula;
  }
}

}  // namespace
}  // namespace dlcs
