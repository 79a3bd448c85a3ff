// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/spice_expression.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dlcs::client {
namespace {

using ::testing::HasSubstr;

TEST(SpiceNumberTest, ReadsSuffixesAndIgnoresUnits) {
  EXPECT_EQ(ReadSpiceNumber("10k"), 10e3);
  EXPECT_EQ(ReadSpiceNumber("47uF"), 47e-6);
  EXPECT_EQ(ReadSpiceNumber("47\xc2\xb5"), 47e-6);
  EXPECT_EQ(ReadSpiceNumber("1Meg"), 1e6);
  EXPECT_EQ(ReadSpiceNumber("1MegOhm"), 1e6);
  EXPECT_EQ(ReadSpiceNumber("1M"), 1e-3);
  EXPECT_EQ(ReadSpiceNumber("1MIL"), 25.4e-6);
  EXPECT_EQ(ReadSpiceNumber("1F"), 1e-15);
  EXPECT_EQ(ReadSpiceNumber("5V"), 5);
  EXPECT_EQ(ReadSpiceNumber("5A"), 5);
  EXPECT_EQ(ReadSpiceNumber("-.5e-3k"), -0.5);
  EXPECT_EQ(ReadSpiceNumber("2.2T"), 2.2e12);
}

TEST(SpiceNumberTest, RefusesWhatDialectsReadDifferently) {
  for (const char* text : {"4k7", "", "k", "1.2.3", "--1", "1e400", "1 k", "{1}", "0x10"}) {
    EXPECT_EQ(ReadSpiceNumber(text), std::nullopt) << text;
  }
}

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
  EXPECT_EQ(value("2**3**2"), 512);
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
  EXPECT_THAT(fault("1 + nix"), HasSubstr("\"nix\" is no parameter"));
  EXPECT_THAT(fault("nix(1)"), HasSubstr("\"nix\" is no function"));
  EXPECT_THAT(fault("1/0"), HasSubstr("not finite"));
  EXPECT_THAT(fault("sqrt(-1)"), HasSubstr("no finite value"));
  EXPECT_THAT(fault("2^3"), HasSubstr("exclusive or"));
  EXPECT_THAT(fault("1 +"), HasSubstr("ends too early"));
  EXPECT_THAT(fault("(1"), HasSubstr("missing"));
  EXPECT_THAT(fault("1 2"), HasSubstr("column 3"));
  EXPECT_THAT(fault("v(a)"), HasSubstr("B, E and G"));
  EXPECT_THAT(fault("time"), HasSubstr("time is not supported"));
  EXPECT_THAT(fault(std::string(1000, '(')), HasSubstr("nested"));
  EXPECT_THAT(fault(std::string(1000, '-')), HasSubstr("nested"));
}

TEST(SpiceExpressionTest, KeepsLinearFunctionsOfVoltagesAndCurrents) {
  ParameterScope scope;
  scope.Define("gain", "3");
  const auto value = scope.EvaluateLinear("2 + gain*(V(a, b) - 4)/2 - I(V1) + V(a,b)");
  ASSERT_TRUE(value.ok()) << value.status();
  EXPECT_EQ(value->constant, -4);
  EXPECT_EQ(value->factors.at("v(a,b)"), 2.5);
  EXPECT_EQ(value->factors.at("i(v1)"), -1);
  EXPECT_THAT(scope.EvaluateLinear("V(a)*V(b)").status().message(), HasSubstr("not linear"));
  EXPECT_THAT(scope.EvaluateLinear("sin(V(a))").status().message(), HasSubstr("not linear"));
  EXPECT_THAT(scope.EvaluateLinear("V(a) > 1 ? 1 : 2").status().message(), HasSubstr("not linear"));
}

}  // namespace
}  // namespace dlcs::client
