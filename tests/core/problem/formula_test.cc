// SPDX-License-Identifier: Apache-2.0
#include "core/problem/formula.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <locale>
#include <string>
#include <utility>

#include "core/problem/formula_syntax.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

double ValueOf(const std::string& text, double t) {
  absl::StatusOr<Formula> formula = Formula::Parse(text);
  EXPECT_TRUE(formula.ok()) << text << ": " << formula.status();
  return formula.ok() ? formula->Evaluate(t) : std::numeric_limits<double>::quiet_NaN();
}

std::string ErrorOf(const std::string& text) {
  const absl::StatusOr<Formula> formula = Formula::Parse(text);
  if (formula.ok()) return "accepted";
  EXPECT_EQ(formula.status().code(), absl::StatusCode::kInvalidArgument) << formula.status();
  return std::string(formula.status().message());
}

struct Reading {
  const char* text;
  double t;
  double value;
};

// The values are those of Python 3.11, float(eval(text)) after `from math import *`, with sign as
// (v > 0) - (v < 0). They hold to the last bit but for the C library's functions.
const Reading kPythonReadings[] = {
    {"-t**2", 3.0, -9.0},
    {"-t**2", 0.7, -0.48999999999999994},
    {"2**-t", 3.0, 0.125},
    {"2**-t", 0.7, 0.6155722066724582},
    {"2**-t**2", 3.0, 0.001953125},
    {"2**-t**2", 0.7, 0.712025097798536},
    {"t**-1", 3.0, 0.3333333333333333},
    {"t**-1", 0.7, 1.4285714285714286},
    {"-2**2", 3.0, -4.0},
    {"(-2)**2", 3.0, 4.0},
    {"2**3**2", 3.0, 512.0},
    {"t**2**0.5", 3.0, 4.728804387837416},
    {"t**2**0.5", 0.7, 0.6038590053932679},
    {"--t", 3.0, 3.0},
    {"--t", 0.7, 0.7},
    {"-+t", 3.0, -3.0},
    {"-+t", 0.7, -0.7},
    {"+-+-t", 3.0, 3.0},
    {"+-+-t", 0.7, 0.7},
    {"t--t", 3.0, 6.0},
    {"t--t", 0.7, 1.4},
    {"t+-t", 3.0, 0.0},
    {"t+-t", 0.7, 0.0},
    {"2*-t", 3.0, -6.0},
    {"2*-t", 0.7, -1.4},
    {"2/-t**2", 3.0, -0.2222222222222222},
    {"2/-t**2", 0.7, -4.0816326530612255},
    {"-t*-t", 3.0, 9.0},
    {"-t*-t", 0.7, 0.48999999999999994},
    {"1 - -1", 3.0, 2.0},
    {"0 < t < 1", 3.0, 0.0},
    {"0 < t < 1", 0.7, 1.0},
    {"0 < t <= 3", 3.0, 1.0},
    {"0 < t <= 3", 0.7, 1.0},
    {"3 > t > 1 > 0", 3.0, 0.0},
    {"3 > t > 1 > 0", 0.7, 0.0},
    {"1 < t == 1", 3.0, 0.0},
    {"1 < t == 1", 0.7, 0.0},
    {"0 < t < 5 > 2", 3.0, 1.0},
    {"0 < t < 5 > 2", 0.7, 1.0},
    {"t < 2 < 1", 3.0, 0.0},
    {"t < 2 < 1", 0.7, 0.0},
    {"(t < 2) < 1", 3.0, 1.0},
    {"(t < 2) < 1", 0.7, 0.0},
    {"t == 3", 3.0, 1.0},
    {"t == 3", 0.7, 0.0},
    {"t != 3", 3.0, 0.0},
    {"t != 3", 0.7, 1.0},
    {"t >= 3", 3.0, 1.0},
    {"t >= 3", 0.7, 0.0},
    {"t <= 3", 3.0, 1.0},
    {"t <= 3", 0.7, 1.0},
    {"-(t < 5)", 3.0, -1.0},
    {"-(t < 5)", 0.7, -1.0},
    {"(t < 5)*2 + (t >= 5)*7", 3.0, 2.0},
    {"(t < 5)*2 + (t >= 5)*7", 0.7, 2.0},
    {"1 + t < 5 - t", 3.0, 0.0},
    {"1 + t < 5 - t", 0.7, 1.0},
    {"t < 5 < 4 + 2 != 6", 3.0, 0.0},
    {"t < 5 < 4 + 2 != 6", 0.7, 0.0},
    {"1e-6", 3.0, 1e-06},
    {"1E3", 3.0, 1000.0},
    {".5", 3.0, 0.5},
    {"5.", 3.0, 5.0},
    {"5.e2", 3.0, 500.0},
    {"1000e-6", 3.0, 0.001},
    {"1e+3*t", 3.0, 3000.0},
    {"1e+3*t", 0.7, 700.0},
    {"0.1 + 0.2", 3.0, 0.30000000000000004},
    {"(t<5)*10/(100*1000e-6)", 3.0, 100.0},
    {"(t<5)*10/(100*1000e-6)", 0.7, 100.0},
    {"000", 3.0, 0.0},
    {"00.5", 3.0, 0.5},
    {"1.7976931348623157e308", 3.0, 1.7976931348623157e+308},
    {"4.9e-324", 3.0, 5e-324},
    {"1e-400", 3.0, 0.0},
    {"7/2", 3.0, 3.5},
    {"2*3/4*5", 3.0, 7.5},
    {"2/3/4", 3.0, 0.16666666666666666},
    {"2 - 3 - 4", 3.0, -5.0},
    {"6/2*3", 3.0, 9.0},
    {"2*t**3", 3.0, 54.0},
    {"2*t**3", 0.7, 0.6859999999999998},
    {"(t+1e16)-1e16", 3.0, 4.0},
    {"(t+1e16)-1e16", 0.7, 0.0},
    {"0.1*t*0.1", 3.0, 0.030000000000000006},
    {"0.1*t*0.1", 0.7, 0.006999999999999999},
    {"3*(t-0.1)", 3.0, 8.7},
    {"3*(t-0.1)", 0.7, 1.7999999999999998},
    {"t/3*3", 3.0, 3.0},
    {"t/3*3", 0.7, 0.7},
    {"t**4", 3.0, 81.0},
    {"t**4", 0.7, 0.24009999999999995},
    {"t**3", 3.0, 27.0},
    {"t**3", 0.7, 0.3429999999999999},
    {"sin(t)", 3.0, 0.1411200080598672},
    {"sin(t)", 0.7, 0.644217687237691},
    {"cos(t)", 3.0, -0.9899924966004454},
    {"cos(t)", 0.7, 0.7648421872844885},
    {"tan(t)", 3.0, -0.1425465430742778},
    {"tan(t)", 0.7, 0.8422883804630794},
    {"asin(t/4)", 3.0, 0.848062078981481},
    {"asin(t/4)", 0.7, 0.17590576816371628},
    {"acos(t/4)", 3.0, 0.7227342478134157},
    {"acos(t/4)", 0.7, 1.3948905586311804},
    {"atan(t)", 3.0, 1.2490457723982544},
    {"atan(t)", 0.7, 0.6107259643892086},
    {"sinh(t)", 3.0, 10.017874927409903},
    {"sinh(t)", 0.7, 0.7585837018395334},
    {"cosh(t)", 3.0, 10.067661995777765},
    {"cosh(t)", 0.7, 1.255169005630943},
    {"tanh(t)", 3.0, 0.9950547536867305},
    {"tanh(t)", 0.7, 0.6043677771171636},
    {"exp(-t)", 3.0, 0.049787068367863944},
    {"exp(-t)", 0.7, 0.4965853037914095},
    {"log(t)", 3.0, 1.0986122886681098},
    {"log(t)", 0.7, -0.35667494393873245},
    {"log10(t)", 3.0, 0.47712125471966244},
    {"log10(t)", 0.7, -0.1549019599857432},
    {"sqrt(t)", 3.0, 1.7320508075688772},
    {"sqrt(t)", 0.7, 0.8366600265340756},
    {"abs(-t)", 3.0, 3.0},
    {"abs(-t)", 0.7, 0.7},
    {"sign(-t)", 3.0, -1.0},
    {"sign(-t)", 0.7, -1.0},
    {"sign(0)", 3.0, 0.0},
    {"floor(-t/2)", 3.0, -2.0},
    {"floor(-t/2)", 0.7, -1.0},
    {"ceil(-t/2)", 3.0, -1.0},
    {"ceil(-t/2)", 0.7, 0.0},
    {"min(t, 1, 2)", 3.0, 1.0},
    {"min(t, 1, 2)", 0.7, 0.7},
    {"max(t, 1, 2)", 3.0, 3.0},
    {"max(t, 1, 2)", 0.7, 2.0},
    {"max(1, 2, t + 1, -4)", 3.0, 4.0},
    {"max(1, 2, t + 1, -4)", 0.7, 2.0},
    {"min(t < 5, 0.5)", 3.0, 0.5},
    {"min(t < 5, 0.5)", 0.7, 0.5},
    {"pi", 3.0, 3.141592653589793},
    {"e", 3.0, 2.718281828459045},
    {"e**t", 3.0, 20.085536923187664},
    {"e**t", 0.7, 2.013752707470476},
    {"2*pi*e", 3.0, 17.079468445347132},
    {"1e1*e", 3.0, 27.18281828459045},
    {"-pi**2", 3.0, -9.869604401089358},
    {"2*exp(-t/2)*sin(pi*t)", 3.0, 1.6395338185140652e-16},
    {"2*exp(-t/2)*sin(pi*t)", 0.7, 1.1402092806321138},
    {"cos(3*t)*min(t,1)-0.1", 3.0, -1.011130261884677},
    {"cos(3*t)*min(t,1)-0.1", 0.7, -0.45339227321989994},
    {"-0.3+0.2*t**1.5", 3.0, 0.7392304845413264},
    {"-0.3+0.2*t**1.5", 0.7, -0.18286759628522942},
    {"sqrt(abs(1 - cos(t**2)))", 3.0, 1.3824363500301478},
    {"sqrt(abs(1 - cos(t**2)))", 0.7, 0.34302644415537187},
    {"3*cos(3*pi*t)", 3.0, -3.0},
    {"3*cos(3*pi*t)", 0.7, 2.853169548885461},
    {"2 + t*exp(-t/2)", 3.0, 2.6693904804452897},
    {"2 + t*exp(-t/2)", 0.7, 2.493281662803099},
    {"4*sin(4*pi*t)*(abs(t - 0.5) <= 0.25)", 3.0, -0.0},
    {"4*sin(4*pi*t)*(abs(t - 0.5) <= 0.25)", 0.7, 2.3511410091698934},
    {" ( ( t ) ) ", 3.0, 3.0},
    {" ( ( t ) ) ", 0.7, 0.7},
    {"\tt\n *\r\n 2 ", 3.0, 6.0},
    {"\tt\n *\r\n 2 ", 0.7, 1.4},
    {"sin ( t )", 3.0, 0.1411200080598672},
    {"sin ( t )", 0.7, 0.644217687237691},
    {"abs(abs(abs(-t)))", 3.0, 3.0},
    {"abs(abs(abs(-t)))", 0.7, 0.7},
    {"max(-t**2, -t**-2)", 3.0, -0.1111111111111111},
    {"max(-t**2, -t**-2)", 0.7, -0.48999999999999994},
    {"-t**-t", 3.0, -0.037037037037037035},
    {"-t**-t", 0.7, -1.283604916843771},
    {"(2)**(3)", 3.0, 8.0},
    {"-(-(-t))", 3.0, -3.0},
    {"-(-(-t))", 0.7, -0.7},
    {"0**0", 3.0, 1.0},
    {"exp(exp(exp(0)))", 3.0, 15.154262241479262},
    {"(1 < 2) + (2 < 3)", 3.0, 2.0},
    {"(t)**(t)/(t)", 3.0, 9.0},
    {"(t)**(t)/(t)", 0.7, 1.1129370181006415},
    {"2**0.5", 3.0, 1.4142135623730951},
    {"1/3", 3.0, 0.3333333333333333},
};

TEST(FormulaTest, ReadsAsPythonDoes) {
  for (const Reading& reading : kPythonReadings) {
    EXPECT_DOUBLE_EQ(ValueOf(reading.text, reading.t), reading.value) << reading.text << " at t = " << reading.t;
  }
}

TEST(FormulaTest, ReadsCaretAsPower) {
  EXPECT_EQ(ValueOf("-t^2", 3), -9);
  EXPECT_EQ(ValueOf("2^3^2", 0), 512);
  EXPECT_EQ(ValueOf("2^-t**2", 1), 0.5);
}

TEST(FormulaTest, HasNoFiniteValueWherePythonRaisesAnError) {
  EXPECT_EQ(ValueOf("1/t", 0), std::numeric_limits<double>::infinity());
  EXPECT_EQ(ValueOf("log(t)", 0), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(ValueOf("1/0", 0), std::numeric_limits<double>::infinity());
  EXPECT_EQ(ValueOf("exp(1000)", 0), std::numeric_limits<double>::infinity());
  for (const char* text : {"sqrt(t)", "log(t)", "log10(t)", "asin(2*t)", "acos(2*t)", "t**0.5", "0*sqrt(t)",
                           "min(sqrt(t), 1)", "min(1, sqrt(t))", "max(sqrt(t), 1)", "max(1, sqrt(t), 2)",
                           "(0 < t)*sqrt(t)", "sign(sqrt(t))", "floor(sqrt(t))"}) {
    EXPECT_TRUE(std::isnan(ValueOf(text, -1))) << text;
  }
}

TEST(FormulaTest, KnowsWhetherItDependsOnTime) {
  EXPECT_TRUE(Formula::Parse("sin(t)")->DependsOnTime());
  EXPECT_TRUE(Formula::Parse("0*t")->DependsOnTime());
  EXPECT_FALSE(Formula::Parse("2*pi - tan(1e3)**2")->DependsOnTime());
}

TEST(FormulaTest, StaysValidWhenMoved) {
  Formula first = *Formula::Parse("2*t");
  Formula second = std::move(first);
  EXPECT_EQ(second.Evaluate(4), 8);
  first = *Formula::Parse("t - 1");
  EXPECT_EQ(first.Evaluate(4), 3);
  second = std::move(first);
  EXPECT_EQ(second.Evaluate(5), 4);
}

TEST(FormulaTest, IgnoresTheLocale) {
  struct CommaPoint : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new CommaPoint));
  const double value = ValueOf("1234.5 + 0.25*t", 2);
  const std::string error = ErrorOf("1234567 + 0,5");
  std::locale::global(before);
  EXPECT_EQ(value, 1235);
  EXPECT_THAT(error, StartsWith("at position 12: found ','"));
}

struct Refusal {
  const char* text;
  int position;
  const char* reason;
};

const Refusal kRefusals[] = {
    {"", 1, "empty"},
    {"  \n ", 1, "empty"},
    {"t = 5", 3, "write == to compare"},
    {"t=5", 2, "write == to compare"},
    {"t,2", 2, "decimal point"},
    {"0,5", 2, "decimal point"},
    {"(1, 2)", 3, "decimal point"},
    {"t; 2", 2, "found ';'"},
    {"t ? 1 : 2", 3, "comparisons"},
    {"1 if t < 2 else 3", 3, "comparisons"},
    {"0 < t && t < 1", 7, "0 < t < 1"},
    {"0 < t and t < 1", 7, "0 < t < 1"},
    {"0 < t & t < 1", 7, "0 < t < 1"},
    {"t < 0 || t > 1", 7, "max(a, b)"},
    {"t < 0 or t > 1", 7, "max(a, b)"},
    {"!t", 1, "a == 0"},
    {"not t", 1, "a == 0"},
    {"~t", 1, "a == 0"},
    {"t // 2", 3, "floor(a/b)"},
    {"t % 2", 3, "floor(a/b)"},
    {"'t'", 1, "strings"},
    {"\"t\"", 1, "strings"},
    {"sin[t]", 4, "write parentheses"},
    {"2*[t]", 3, "parentheses"},
    {"t <> 2", 4, "found '>'"},
    {"t << 2", 4, "found '<'"},
    {"t*", 3, "the formula ends"},
    {"2 + ", 5, "the formula ends"},
    {"*t", 1, "found '*'"},
    {"t * / 2", 5, "found '/'"},
    {"t *** 2", 5, "found '*'"},
    {"t^^2", 3, "found '^'"},
    {"< 2", 1, "found '<'"},
    {"2t", 2, "2*t"},
    {"2 t", 3, "2*t"},
    {"t t", 3, "2*t"},
    {"t 2", 3, "2*t"},
    {"2(t)", 2, "2*t"},
    {"(t)(t)", 4, "2*t"},
    {"(t)2", 4, "2*t"},
    {"2sin(t)", 2, "2*t"},
    {"t(2)", 2, "'t' is not a function"},
    {"pi(2)", 3, "'pi' is not a function"},
    {"sin t", 1, "sin(t)"},
    {"sin", 1, "sin(t)"},
    {"sin + 1", 1, "sin(t)"},
    {"sin()", 5, "needs an argument"},
    {"min()", 5, "needs an argument"},
    {"min(,t)", 5, "found ','"},
    {"min(t,)", 7, "found ')'"},
    {"sin(t, 1)", 6, "takes one argument"},
    {"log(t, 2)", 6, "takes one argument"},
    {"()", 2, "found ')'"},
    {"(t", 1, "never closed"},
    {"2*(t + (1)", 3, "never closed"},
    {"sin(t", 4, "never closed"},
    {"t)", 2, "closes nothing"},
    {"(t))", 4, "closes nothing"},
    {"(t t)", 4, "2*t"},
    {"1_000", 1, "1000"},
    {"1e", 1, "exponent"},
    {"2e*t", 1, "2*e"},
    {"1e+", 1, "exponent"},
    {"1e400", 1, "range of a double"},
    {"1.2.3", 1, "one decimal point"},
    {"1..2", 1, "one decimal point"},
    {"2j", 1, "real"},
    {"0x10", 1, "decimal"},
    {"007", 1, "begin with 0"},
    {".", 1, "a point belongs to a number"},
    {"t.real", 2, "names have no prefix"},
    {"np.sin(t)", 1, "without a prefix"},
    {"math.pi", 1, "without a prefix"},
    {"sine(t)", 1, "'sine'; did you mean 'sin'?"},
    {"2*Sin(t)", 3, "'Sin'; did you mean 'sin'?"},
    {"T", 1, "'T'; did you mean 't'?"},
    {"sqr(t)", 1, "did you mean 'sqrt'?"},
    {"floot(t)", 1, "did you mean 'floor'?"},
    {"sni(t)", 1, "did you mean 'sin'?"},
    {"epx(t)", 1, "did you mean 'exp'?"},
    {"ln(t)", 1, "write log, the natural logarithm"},
    {"pow(t, 2)", 1, "a**b"},
    {"arctan(t)", 1, "atan"},
    {"heaviside(t)", 1, "(t >= 0)"},
    {"True*t", 1, "write 1"},
    {"inf", 1, "finite"},
    {"1 + nan", 5, "finite"},
    {"x", 1, "unknown name 'x'; formulas in states and constraints need \"kind\": \"nonlinear\""},
    {"time", 1, "unknown name 'time'; the names are t pi e sin"},
    {"omega*t", 1, "max; numbers of your own go into \"parameters\""},
    {"t @ t", 3, "found '@'"},
    {"t # comment", 3, "found '#'"},
    {"t\\\n+1", 2, "found '\\'"},
    {"$t", 1, "found '$'"},
    {"t \xE2\x88\x92 1", 3, "found '\xE2\x88\x92'; this is U+2212"},
    {"t \xE2\x88\x92 1", 3, "write the plain minus -"},
    {"2\xC3\x97t", 2, "write *"},
    {"2*\xCF\x80*t", 3, "write pi"},
    {"t\xC2\xB2", 2, "write **2"},
    {"t \xE2\x89\xA4 1", 3, "write <="},
    {"t\xC2\xA0+ 1", 2, "plain space"},
    {"\xEF\xBB\xBFt", 1, "byte order mark"},
    {"t + \xF0\x9F\x98\x80", 5, "U+1F600"},
    {"t + \xE2\x88", 5, "the byte 0xE2 is neither ASCII nor UTF-8"},
    {"t + \xC0\x80", 5, "the byte 0xC0"},
    {"t + \xED\xA0\x80", 5, "the byte 0xED"},
    {"t + \xFF", 5, "the byte 0xFF"},
    {"t\x01", 2, "control character 0x01"},
    {"t\x7F", 2, "control character 0x7F"},
};

TEST(FormulaTest, RefusesWhatIsOutsideTheLanguageWithPositionAndAdvice) {
  for (const Refusal& refusal : kRefusals) {
    const std::string error = ErrorOf(refusal.text);
    EXPECT_THAT(error, StartsWith("at position " + std::to_string(refusal.position) + ": ")) << refusal.text;
    EXPECT_THAT(error, HasSubstr(refusal.reason)) << refusal.text;
  }
}

TEST(FormulaTest, RefusesZeroBytes) {
  EXPECT_THAT(ErrorOf(std::string("t\0+1", 4)), StartsWith("at position 2: the control character 0x00"));
}

TEST(FormulaTest, KnowsNoOtherFunctions) {
  for (const char* name :
       {"sum", "avg", "rint", "log2", "ln", "asinh", "acosh", "atanh", "atan2", "_pi", "_e", "chain"}) {
    EXPECT_THAT(ErrorOf(std::string(name) + "(t, 1)"), StartsWith("at position 1: unknown name")) << name;
  }
}

std::string Repeated(const std::string& text, int count) {
  std::string result;
  for (int i = 0; i < count; ++i) result += text;
  return result;
}

TEST(FormulaTest, LimitsTheDepthOfNesting) {
  EXPECT_EQ(ValueOf(Repeated("(", 100) + "t" + Repeated(")", 100), 2), 2);
  EXPECT_THAT(ErrorOf(Repeated("(", 101) + "t" + Repeated(")", 101)),
              StartsWith("at position 101: nested deeper than 100 levels"));
  EXPECT_EQ(ValueOf("1" + Repeated("**t", 100), 2), 1);
  EXPECT_THAT(ErrorOf("1" + Repeated("**t", 101)), HasSubstr("nested deeper"));
  EXPECT_THAT(ErrorOf(Repeated("sin(", 16'000)), HasSubstr("nested deeper"));
  EXPECT_EQ(ValueOf(Repeated("-", 60'001) + "t", 2), -2);
}

TEST(FormulaTest, LimitsTheLength) {
  EXPECT_EQ(ValueOf("t" + Repeated("+t", 30'000), 1), 30'001);
  EXPECT_EQ(ValueOf("t" + std::string(65'535, ' '), 1), 1);
  EXPECT_THAT(ErrorOf("t" + std::string(65'536, ' ')), HasSubstr("65537 bytes; at most 65536"));
}

// Each level of this text would double it, were a chained comparison rewritten as a product.
TEST(FormulaTest, ReadsNestedChainsInLinearSpace) {
  EXPECT_EQ(ValueOf(Repeated("0 <= (", 90) + "t" + Repeated(") <= 1", 90), 0.5), 1);
  EXPECT_EQ(ValueOf(Repeated("0 < (", 90) + "t" + Repeated(") < 1", 90), 0.5), 0);
  EXPECT_LT(ReadFormula("0" + Repeated("<t", 4'000))->steps.size(), 20'000u);
}

TEST(FormulaTest, CallsParametersByTheirNames) {
  const FormulaVariables variables{.states = 1, .parameters = {{"omega", 314}, {"x", 2}, {"duty_1", 0.25}}};
  auto formula = Formula::Parse("omega*t + x + duty_1*x1", variables);
  ASSERT_TRUE(formula.ok()) << formula.status();
  EXPECT_EQ(formula->Evaluate(2, Vector::Constant(1, 4.0), Vector()), 631);
  const auto misspelled = Formula::Parse("omga*t", variables);
  EXPECT_THAT(std::string(misspelled.status().message()), HasSubstr("did you mean 'omega'?"));
  const auto called = Formula::Parse("omega(t)", variables);
  EXPECT_THAT(std::string(called.status().message()), HasSubstr("'omega' is not a function"));
}

TEST(FormulaTest, SaysWhichNamesParametersMayHave) {
  for (const char* name : {"omega", "R_1", "_", "x", "y", "x_1", "T", "xy1", "ln", "X1"}) {
    EXPECT_EQ(FaultOfParameterName(name), "") << name;
  }
  for (const char* name :
       {"", " a", "a b", "1a", "a-b", "t", "pi", "e", "sin", "max", "x1", "y12", "x01", "and", "ω"}) {
    EXPECT_NE(FaultOfParameterName(name), "") << name;
  }
}

TEST(FormulaTest, PointsToNonlinearProblemsWhereStatesAreNamed) {
  EXPECT_THAT(ErrorOf("2*x1"), HasSubstr("\"kind\": \"nonlinear\""));
  EXPECT_THAT(ErrorOf("y3 + t"), HasSubstr("\"kind\": \"nonlinear\""));
}

}  // namespace
}  // namespace dlcs
