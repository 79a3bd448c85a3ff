// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/spice_expression.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace dlcs::client {
namespace {

using ::testing::HasSubstr;

TEST(SpiceExpressionTest, ComputesAsPythonDoes) {
  ParameterScope scope;
  scope.Define("r", "2*c + 1k");
  scope.Define("c", "3");
  scope.DefineFunction("par", {"a", "b"}, "a*b/(a+b)");
  const auto value = [&scope](const std::string& text) {
    const auto result = scope.Evaluate(text);
    EXPECT_TRUE(result.ok()) << text << ": " << result.status();
    return result.value_or(0);
  };
  EXPECT_EQ(value("r"), 1006);
  EXPECT_EQ(value("-2**2"), -4);
  EXPECT_EQ(value("(2**3)**2 + 2**(3**2)"), 576);
  EXPECT_EQ(value("2**-1"), 0.5);
  EXPECT_EQ(value("1 - 2 - 3"), -4);
  EXPECT_EQ(value("8/2/2"), 2);
  EXPECT_EQ(value("par(6, c)"), 2);
  EXPECT_EQ(value("c > 2 ? 10k : 1/0"), 10e3);
  EXPECT_EQ(value("if(c==3, 1, 2)"), 1);
  EXPECT_EQ(value("!(1 && 0) || 0"), 1);
  EXPECT_EQ(value("max(1, min(5, 3), 2) + sgn(-4) + int(-1.5) + abs(-2)"), 3);
  EXPECT_DOUBLE_EQ(value("sqrt(16)*cos(pi) + ln(exp(2)) + log10(1k)"), 1);
}

TEST(SpiceExpressionTest, NamesWhatIsWrong) {
  ParameterScope scope;
  scope.Define("a", "b+1");
  scope.Define("b", "2*a");
  const auto fault = [&scope](const std::string& text) { return std::string(scope.Evaluate(text).status().message()); };
  EXPECT_THAT(fault("a"), HasSubstr("defined by itself"));
  EXPECT_THAT(fault("1 + nix"), HasSubstr("\"nix\" is not a parameter"));
  EXPECT_THAT(fault("nix(1)"), HasSubstr("\"nix\" is not a function"));
  EXPECT_THAT(fault("1/0"), HasSubstr("not finite"));
  EXPECT_THAT(fault("sqrt(-1)"), HasSubstr("no finite value"));
  EXPECT_THAT(fault("2^3"), HasSubstr("exclusive or"));
  EXPECT_THAT(fault("2**3**2"), HasSubstr("powers of powers"));  // 64 in ngspice
  EXPECT_THAT(fault("1 +"), HasSubstr("ends too early"));
  EXPECT_THAT(fault("(1"), HasSubstr("missing"));
  EXPECT_THAT(fault("1 2"), HasSubstr("column 3"));
  EXPECT_THAT(fault("v(a)"), HasSubstr("B, E and G"));
  EXPECT_THAT(fault("time"),
              HasSubstr("time is allowed in the expressions of B, E and G elements only, and not in their parameters"));
  EXPECT_THAT(fault(std::string(1000, '(')), HasSubstr("nested"));
  EXPECT_THAT(fault(std::string(1000, '-')), HasSubstr("nested"));
}

// Each function calls the one before twice.
TEST(SpiceExpressionTest, EndsWhereFunctionsCallTooManyFunctions) {
  ParameterScope scope;
  scope.DefineFunction("f0", {"x"}, "x");
  for (int k = 1; k < 40; ++k)
    scope.DefineFunction(fmt::format("f{}", k), {"x"}, fmt::format("f{0}(x)+f{0}(x)", k - 1));
  EXPECT_EQ(scope.Evaluate("f5(1)").value_or(0), 32);
  EXPECT_THAT(std::string(scope.Evaluate("f39(1)").status().message()), HasSubstr("calls too many functions"));
}

// Those of subcircuits count for the whole deck.
TEST(SpiceExpressionTest, EndsWhereExpressionsTogetherCallTooManyFunctions) {
  ParameterScope outer;
  outer.DefineFunction("f0", {"x"}, std::string(1000, ' ') + "x");
  outer.DefineFunction("f", {"x"}, "f0(x)+f0(x)+f0(x)+f0(x)+f0(x)+f0(x)+f0(x)+f0(x)");
  int read = 0;
  std::string end;
  for (; read < 1000 && end.empty(); ++read) {
    ParameterScope inner(&outer);
    end = std::string(inner.Evaluate("f(1)").status().message());
  }
  EXPECT_THAT(end, HasSubstr("calls too many functions"));
  EXPECT_GT(read, 200);
}

TEST(SpiceExpressionTest, EndsWhereLongSumsAreMultipliedTooOften) {
  const PiecewiseMaker none = [](const LinearValue&, const PiecewiseLinear&) { return "v(none)"; };
  std::string sum = "V(n0)", product;
  for (int k = 1; k < 3000; ++k) sum += fmt::format("+V(n{})", k);
  for (int k = 0; k < 1000; ++k) product += "*1";
  ParameterScope scope;
  EXPECT_EQ(scope.EvaluateLinear("(" + sum + ")*2", none)->factors.size(), 3000u);
  EXPECT_THAT(std::string(scope.EvaluateLinear("(" + sum + ")" + product, none).status().message()),
              HasSubstr("too much is done with long sums"));
  ParameterScope short_sums;
  EXPECT_TRUE(short_sums.EvaluateLinear("(V(a)+V(b))" + product + product, none).ok());
}

// The text of its argument doubles with each call.
TEST(SpiceExpressionTest, EndsWhereAFunctionOfTimeGrowsTooLong) {
  ParameterScope scope;
  scope.DefineFunction("f", {"x"}, "x+x");
  const PiecewiseMaker none = [](const LinearValue&, const PiecewiseLinear&) { return "v(none)"; };
  std::string deep = "time";
  for (int k = 0; k < 30; ++k) deep = "f(" + deep + ")";
  EXPECT_TRUE(scope.EvaluateLinear("f(f(time))", none).ok());
  EXPECT_THAT(std::string(scope.EvaluateLinear(deep, none).status().message()),
              HasSubstr("the function of time is too long"));
}

TEST(SpiceExpressionTest, KeepsLinearFunctionsOfVoltagesAndCurrents) {
  ParameterScope scope;
  scope.Define("gain", "3");
  const PiecewiseMaker none = [](const LinearValue&, const PiecewiseLinear&) { return "v(none)"; };
  const auto value = scope.EvaluateLinear("2 + gain*(V(a, b) - 4)/2 - I(V1) + V(a,b)", none);
  ASSERT_TRUE(value.ok()) << value.status();
  EXPECT_EQ(value->constant, -4);
  EXPECT_EQ(value->factors.at("v(a,b)"), 2.5);
  EXPECT_EQ(value->factors.at("i(v1)"), -1);
  const auto fault = [&](const char* text) { return std::string(scope.EvaluateLinear(text, none).status().message()); };
  EXPECT_THAT(fault("V(a)*V(b)"), HasSubstr("not linear"));
  EXPECT_THAT(fault("sin(V(a))"), HasSubstr("not linear"));
  EXPECT_THAT(fault("V(a) == 1 ? 1 : 2"), HasSubstr("equal"));
  EXPECT_THAT(fault("V(a) > 1 ? V(b) : 2"), HasSubstr("between numbers"));
  EXPECT_THAT(fault("V(a) > 1 ? V(b) + 2*V(a) : V(a)"), HasSubstr("a multiple of what is compared"));
  EXPECT_THAT(fault("V(a) ? 1 : 2"), HasSubstr("comparison"));
}

// What the functions of a made up voltage are, at some of its values.
TEST(SpiceExpressionTest, MakesPiecewiseLinearFunctions) {
  const auto at = [](const std::string& text, double volts) {
    std::map<std::string, double> values = {{"v(a)", volts}};
    const PiecewiseMaker make = [&values](const LinearValue& argument, const PiecewiseLinear& function) {
      double x = argument.constant;
      for (const auto& [name, factor] : argument.factors) x += factor * values.at(name);
      double y = function.y.front() + function.slope_before * std::min(0.0, x - function.x.front()) +
                 function.slope_after * std::max(0.0, x - function.x.back());
      for (std::size_t k = 1; k < function.x.size(); ++k) {
        const double run = function.x[k] - function.x[k - 1];
        const double part = run > 0 ? std::clamp((x - function.x[k - 1]) / run, 0.0, 1.0) : (x > function.x[k] ? 1 : 0);
        y += part * (function.y[k] - function.y[k - 1]);
      }
      const std::string name = "v( " + std::to_string(values.size()) + ")";
      values[name] = y;
      return name;
    };
    ParameterScope scope;
    const auto value = scope.EvaluateLinear(text, make);
    EXPECT_TRUE(value.ok()) << value.status();
    double sum = value.ok() ? value->constant : 0;
    if (value.ok()) {
      for (const auto& [name, factor] : value->factors) sum += factor * values.at(name);
    }
    return sum;
  };
  for (const double x : {-3.0, -0.5, 0.25, 1.5, 7.0}) {
    EXPECT_DOUBLE_EQ(at("max(V(a), 1) + min(2*V(a), 3, V(a)+1)", x), std::max(x, 1.0) + std::min({2 * x, 3.0, x + 1}));
    EXPECT_DOUBLE_EQ(at("abs(V(a)-1) + uramp(-V(a))", x), std::abs(x - 1) + std::max(0.0, -x));
    EXPECT_DOUBLE_EQ(at("max(V(a), {1+1})", x), std::max(x, 2.0));
    EXPECT_DOUBLE_EQ(at("limit(10*V(a), -5, 5)", x), std::clamp(10 * x, -5.0, 5.0));
    EXPECT_DOUBLE_EQ(at("V(a) > 1 ? 5 : 2", x), x > 1 ? 5 : 2);
    EXPECT_DOUBLE_EQ(at("V(a) > 0 ? V(a) : 0", x), std::max(x, 0.0));
    EXPECT_DOUBLE_EQ(at("if((V(a) < 1), 3 - V(a), 2*V(a))", x), x < 1 ? 3 - x : 2 * x);
    EXPECT_DOUBLE_EQ(at("((2*V(a) > 1)) ? {V(a)} : 4", x), x > 0.5 ? x : 4);
    EXPECT_DOUBLE_EQ(at("if(V(a)>1, 5, if(V(a)<-1, -5, V(a)>0 ? 2 : 1))", x), x > 1 ? 5 : x < -1 ? -5 : x > 0 ? 2 : 1);
    EXPECT_DOUBLE_EQ(at("if(V(a)<0 || V(a)>1, 1, 0) + u(V(a)) + sgn(V(a))", x),
                     (x < 0 || x > 1) + (x > 0) + (x > 0 ? 1 : -1));
    EXPECT_DOUBLE_EQ(at("!(V(a)>0 && V(a)<2) ? 1 : 0", x), !(x > 0 && x < 2));
    EXPECT_DOUBLE_EQ(at("if(V(a)>1, 5, 2)", x), x > 1 ? 5 : 2);
    EXPECT_DOUBLE_EQ(at("if(1 >= V(a), 5, 0) + if((V(a)>0), {1}, 0)", x), (x <= 1 ? 5 : 0) + (x > 0 ? 1 : 0));
    EXPECT_DOUBLE_EQ(at("(5*(V(a)>1))", x), x > 1 ? 5 : 0);
    EXPECT_DOUBLE_EQ(at("max(2 + (V(a)>1), 2.5)", x), x > 1 ? 3 : 2.5);
    EXPECT_DOUBLE_EQ(at("if(V(a)>0, 1, (1 - 2*(V(a)<-1)))", x), x < -1 ? -1 : 1);
    EXPECT_DOUBLE_EQ(at("(-(V(a)>1)) + (0.5 < (V(a)>0))", x), (x > 1 ? -1 : 0) + (x > 0 ? 1 : 0));
    EXPECT_DOUBLE_EQ(at("V(a)>1 ? 1 : V(a)<-1 ? -1 : V(a)", x), std::clamp(x, -1.0, 1.0));
    EXPECT_DOUBLE_EQ(at("if(2*V(a)<-1, 3*V(a)+1, if(V(a)>2, 7 - V(a), if(V(a)>1, 6, V(a))))", x), x < -0.5 ? 3 * x + 1
                                                                                                  : x > 2  ? 7 - x
                                                                                                  : x > 1  ? 6
                                                                                                           : x);
    EXPECT_DOUBLE_EQ(at("V(a)>0 ? abs(V(a)-1) : table(-V(a), 1, 2, 4, 5)", x),
                     x > 0 ? std::abs(x - 1) : std::clamp(1 - x, 2.0, 5.0));
    EXPECT_DOUBLE_EQ(at("limit(-5, 5, 10*V(a))", x), std::clamp(10 * x, -5.0, 5.0));
    EXPECT_DOUBLE_EQ(at("limit(5, V(a), -5) + limit(V(a), 2*V(a), 1)", x),
                     std::clamp(x, -5.0, 5.0) + std::clamp(1.0, std::min(x, 2 * x), std::max(x, 2 * x)));
    EXPECT_DOUBLE_EQ(at("table(V(a), -1, 2, 1, 4)", x), std::clamp(x + 3, 2.0, 4.0));
    EXPECT_DOUBLE_EQ(at("pwl(V(a), -1, 2, 1, 4)", x), x + 3);
  }
}

}  // namespace
}  // namespace dlcs::client
