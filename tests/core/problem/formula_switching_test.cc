// SPDX-License-Identifier: Apache-2.0
#include "core/problem/formula_switching.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/format_number.h"
#include "core/problem/formula.h"

namespace dlcs {
namespace {

using std::numbers::pi;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

FormulaSwitching SwitchingOf(const std::string& text, double horizon) {
  const auto analyzed = AnalyzeFormula(text, {}, 0, horizon);
  EXPECT_TRUE(analyzed.ok()) << text << ": " << analyzed.status();
  return analyzed.ok() ? (*analyzed)->switching : FormulaSwitching{};
}

// The times of a formula that nothing is said about.
std::vector<double> TimesOf(const std::string& text, double horizon) {
  const FormulaSwitching switching = SwitchingOf(text, horizon);
  EXPECT_EQ(switching.refusal, "") << text;
  EXPECT_THAT(switching.warnings, IsEmpty()) << text;
  return switching.times;
}

struct Limits {
  double left, right;
};
Limits LimitsOf(const std::string& text, double horizon, double t) {
  const auto analyzed = AnalyzeFormula(text, {}, 0, horizon);
  Formula formula(*analyzed, {horizon, (*analyzed)->switching.times});
  return {formula.Evaluate(t, Side::kLeft), formula.Evaluate(t, Side::kRight)};
}

void ExpectTimes(const std::string& text, double horizon, const std::vector<double>& expected) {
  const std::vector<double> times = TimesOf(text, horizon);
  ASSERT_EQ(times.size(), expected.size()) << text;
  for (std::size_t k = 0; k < times.size(); ++k) {
    EXPECT_NEAR(times[k], expected[k], 4e-16 * horizon) << text;
  }
}

TEST(FormulaSwitchingTest, FindsTheTimesOfEverySwitch) {
  ExpectTimes("(t < 5)*2", 10, {5});
  ExpectTimes("(t <= 3.3)*2", 10, {3.3});
  ExpectTimes("0.5 < t < 2", 10, {0.5, 2});
  ExpectTimes("max(0, sin(t))", 10, {pi, 2 * pi, 3 * pi});
  ExpectTimes("abs(t - 1)", 10, {1});
  ExpectTimes("min(t, 5, 10 - t)", 10, {5});
  ExpectTimes("max(sin(t), cos(t))", 7, {pi / 4, 5 * pi / 4});
  ExpectTimes("floor(t/2)", 7, {2, 4, 6});
  ExpectTimes("ceil(3 - t)", 3, {1, 2});
  ExpectTimes("sign(cos(t))", 4, {pi / 2});
  ExpectTimes("t > 1e-20", 10, {1e-20});
  ExpectTimes("exp(-t)*(t - floor(t))", 3, {1, 2});
}

TEST(FormulaSwitchingTest, LooksInsideOtherSwitches) {
  ExpectTimes("max(0, sin(t)) > 0.5", 7, {pi / 6, pi - pi / 6, pi, 2 * pi, 2 * pi + pi / 6});
  ExpectTimes("abs(abs(t - 2) - 1)", 4, {1, 2, 3});
  ExpectTimes("(t - floor(t)) < 0.25", 2, {0.25, 1, 1.25});
}

TEST(FormulaSwitchingTest, FindsNoneWhereNothingSwitches) {
  for (const char* text : {"t", "sin(1e9*t)", "max(t, t)", "abs(0)", "abs(t)", "min(2*t, t + t)", "abs(sin(t) + 2)",
                           "t >= 0", "t > 0", "t < 10", "t == 3", "sqrt(t)", "1/(1 + t**2)", "tanh(50*(t - 5))",
                           "t**0.5", "exp(-((t - 5)/0.001)**2)", "max(0, (t > 20)*(t - 20))"}) {
    EXPECT_THAT(TimesOf(text, 10), IsEmpty()) << text;
  }
}

// What is zero but for the rounding of pi at an end of the time is zero there.
TEST(FormulaSwitchingTest, TakesEndsForEndsWhateverRoundingSays) {
  ExpectTimes("max(0, sin(t + pi))", 4, {pi});
  EXPECT_THAT(TimesOf("max(0, -sin(t + pi))", 3), IsEmpty());
  EXPECT_THAT(TimesOf("max(0, sin(pi*t))", 1), IsEmpty());
}

TEST(FormulaSwitchingTest, PassesTangentialZeros) {
  EXPECT_THAT(TimesOf("(t - 1)**2 > 0", 10), IsEmpty());
  EXPECT_THAT(TimesOf("abs(1 - cos(t))", 10), IsEmpty());
  EXPECT_THAT(TimesOf("max(0, t**2 - 2*t + 1)", 10), IsEmpty());
  EXPECT_THAT(TimesOf("sqrt(abs(1-cos(t**2)))", 1), IsEmpty());
  EXPECT_THAT(TimesOf("max(sin(t)**2 + cos(t)**2, 1)", 0.01), IsEmpty());
  ExpectTimes("(t - 1)**3 > 0", 10, {1});
  EXPECT_EQ(LimitsOf("(t - 1)**2 > 0", 10, 1).left, 1);
  EXPECT_EQ(LimitsOf("(t - 1)**2 > 0", 10, 1).right, 1);
  EXPECT_EQ(LimitsOf("(t == 3)*7", 10, 3).right, 0);
  // Two times that rounding hides, and may yet be two.
  EXPECT_THAT(SwitchingOf("t**2 - 2*t + 1 > 0", 10).warnings, ElementsAre(HasSubstr("could not be distinguished")));
}

TEST(FormulaSwitchingTest, KeepsBothLimits) {
  const struct {
    const char* text;
    double t, left, right;
  } cases[] = {{"(t < 5)*2", 5, 2, 0},
               {"(t <= 5)*2", 5, 2, 0},
               {"(t > 3.3)*t", 3.3, 0, 3.3},
               {"t - floor(t)", 3, 1, 0},
               {"ceil(t)", 3, 3, 4},
               {"sign(t - 4)", 4, -1, 1},
               {"(t > 0)*3", 0, 3, 3},
               {"t/abs(t)", 0, 1, 1},
               {"(t - 1)/abs(t - 1)", 1, -1, 1},
               {"(t >= 0.1 + 0.2)", 0.3, 0, 1},
               {"atan(1/(t - 2))", 2, -pi / 2, pi / 2}};
  for (const auto& c : cases) {
    const Limits limits = LimitsOf(c.text, 10, TimeAxis{10, SwitchingOf(c.text, 10).times}.Nearest(c.t));
    EXPECT_NEAR(limits.left, c.left, 1e-14) << c.text;
    EXPECT_NEAR(limits.right, c.right, 1e-14) << c.text;
  }
}

// The product of sin(t - a) over many a changes its sign at a + k pi and nowhere else.
TEST(FormulaSwitchingTest, MissesNoRootOfProductsOfSines) {
  std::mt19937_64 random(11);
  constexpr double kHorizon = 30;
  for (int trial = 0; trial < 20; ++trial) {
    const int factors = 1 + static_cast<int>(random() % 12);
    std::string product;
    std::vector<double> roots;
    for (int k = 0; k < factors; ++k) {
      const double a = std::uniform_real_distribution<>(0.01, 3.1)(random);
      product += (k ? "*sin(t - " : "sin(t - ") + NumberText(a) + ")";
      for (double root = a; root < kHorizon; root += pi) roots.push_back(root);
    }
    std::sort(roots.begin(), roots.end());
    const std::string text = trial % 2 ? "(" + product + " > 0)" : "abs(" + product + ")";
    const std::vector<double> times = TimesOf(text, kHorizon);
    ASSERT_EQ(times.size(), roots.size()) << text;
    for (std::size_t k = 0; k < roots.size(); ++k) EXPECT_NEAR(times[k], roots[k], 1e-13) << text;
  }
}

// Between two switching times that were found a formula of polynomials with random roots never switches.
TEST(FormulaSwitchingTest, AgreesWithAWalkOverRandomFormulas) {
  std::mt19937_64 random(12);
  const auto number = [&] {
    return NumberText(std::round(200 * std::uniform_real_distribution<>(-1, 1)(random)) / 100);
  };
  for (int trial = 0; trial < 150; ++trial) {
    const std::string a = number() + "*sin(" + number() + "*t + " + number() + ") + " + number();
    const std::string b = number() + "*t + " + number() + "*cos(7*t)";
    const std::string c = "max(" + a + ", " + b + ")";
    const std::string text = trial % 3 == 0   ? "(" + c + " > " + number() + ")*t"
                             : trial % 3 == 1 ? "floor(4*(" + c + "))"
                                              : "sign(abs(" + a + ") - (" + b + ")**2)";
    const FormulaSwitching switching = SwitchingOf(text, 5);
    ASSERT_EQ(switching.refusal, "") << text;
    auto plain = Formula::Parse(text);
    const auto analyzed = AnalyzeFormula(text, {}, 0, 5);
    Formula decided(*analyzed, {5, switching.times});
    for (int k = 0; k < 4000; ++k) {
      const double t = 5 * (k + 0.5) / 4000;
      EXPECT_EQ(plain->Evaluate(t), decided.Evaluate(t)) << text << " at " << NumberText(t);
    }
  }
}

TEST(FormulaSwitchingTest, RefusesMoreSwitchingTimesThanAreAllowed) {
  EXPECT_THAT(TimesOf("floor(1e4*t)", 9.99995), SizeIs(99'999));
  EXPECT_THAT(SwitchingOf("floor(1e7*t)", 10).refusal, HasSubstr("switches more than 100000000 times; at most 100000"));
  EXPECT_THAT(SwitchingOf("max(0, sin(1e7*t))", 10).refusal,
              HasSubstr("switches more than 100000 times before t = 0.0314"));
  EXPECT_THAT(SwitchingOf("(sin(1/t) > 0)", 10).refusal, HasSubstr("switches more than"));
}

TEST(FormulaSwitchingTest, RefusesPolesWithTheirTime) {
  EXPECT_THAT(SwitchingOf("1/(t - 3.14159)", 10).refusal, HasSubstr("at t = 3.14159:"));
  EXPECT_THAT(SwitchingOf("tan(t)", 10).refusal, HasSubstr("at t = 1.57079632679"));
  EXPECT_THAT(SwitchingOf("log(t)", 10).refusal, HasSubstr("at t = 0:"));
  EXPECT_THAT(SwitchingOf("1/(10 - t)", 10).refusal, HasSubstr("at t = 10:"));
  EXPECT_THAT(SwitchingOf("1/sqrt(t)", 10).refusal, HasSubstr("at t = 0:"));
  EXPECT_THAT(SwitchingOf("cos(t)/sin(t - 1)", 10).refusal, HasSubstr("at t = 1:"));
  EXPECT_THAT(SwitchingOf("abs(t - 2)**-0.5", 10).refusal, HasSubstr("at t = 2:"));
  EXPECT_THAT(SwitchingOf("log(abs(t - 7))", 10).refusal, HasSubstr("at t = 7:"));
  EXPECT_THAT(SwitchingOf("(sin(t) - t)/t**5", 10).refusal, HasSubstr("at t = 0:"));
  EXPECT_THAT(SwitchingOf("sqrt(5 - t)", 10).refusal, HasSubstr("at t = 5.000000000000001 (nan), nor after it"));
  EXPECT_THAT(SwitchingOf("exp(1000*t)", 10).refusal, HasSubstr("at t = 0.7097827128933"));
  EXPECT_THAT(SwitchingOf("sqrt(abs(t - 1) - 1e-9)", 10).refusal, HasSubstr("at t = 0.999999999"));
}

TEST(FormulaSwitchingTest, FillsGapsByLimits) {
  const struct {
    const char* text;
    double t, value, tolerance;
  } cases[] = {{"sin(t)/t", 0, 1, 1e-14},
               {"(1 - cos(t))/t**2", 0, 0.5, 1e-9},
               {"(exp(t) - 1)/t", 0, 1, 1e-10},
               {"sin(t - 1)/(t - 1)", 1, 1, 1e-14},
               {"(t**2 - 4)/(t - 2)", 2, 4, 1e-13},
               {"t*log(t)", 0, 0, 1e-12},
               {"t**t", 0, 1, 1e-12},
               {"(t > 1)*(1/t)", 0, 0, 0}};
  for (const auto& c : cases) {
    EXPECT_EQ(SwitchingOf(c.text, 10).refusal, "") << c.text;
    EXPECT_THAT(SwitchingOf(c.text, 10).warnings, IsEmpty()) << c.text;
    const Limits limits = LimitsOf(c.text, 10, c.t);
    EXPECT_NEAR(limits.left, c.value, c.tolerance) << c.text;
    EXPECT_NEAR(limits.right, c.value, c.tolerance) << c.text;
  }
}

TEST(FormulaSwitchingTest, RefusesNothingThatHasValues) {
  for (const char* text :
       {"sqrt(25 - min(t, 5)**2)", "asin(t/10)", "acos(t/10)", "sqrt(1 - cos(t))", "t**1.5", "(10 - t)**0.5",
        "min(1/t, 5)", "exp(-1/t)", "1/(2 + sin(1e6*t))", "log(1 + t)", "(-2)**floor(t)", "t*sin(1/t)",
        "sqrt(max(0, sin(t)))", "cosh(t)/sinh(t + 1)", "1/cosh(30*(t - 5))", "abs(sin(t))**0.3"}) {
    EXPECT_EQ(SwitchingOf(text, 10).refusal, "") << text;
  }
}

TEST(FormulaSwitchingTest, KeepsRootsOfWhatIsNeverNegative) {
  for (const char* text : {"sqrt(abs(cos(2*t)))", "sqrt(max(0, sin(t)))", "sqrt(1 - min(1, 2*cos(t)))"}) {
    for (const double time : TimesOf(text, 10)) {
      EXPECT_NEAR(LimitsOf(text, 10, time).left, 0, 1e-7) << text;
      EXPECT_NEAR(LimitsOf(text, 10, time).right, 0, 1e-7) << text;
    }
  }
}

TEST(FormulaSwitchingTest, SaysWhereNoLimitIsSeen) {
  EXPECT_THAT(SwitchingOf("sin(1/t)", 10).warnings, ElementsAre(HasSubstr("could not be decided")));
}

TEST(FormulaSwitchingTest, LooksAtThePartsInTimeAloneWhereThereAreStates) {
  const auto analyzed =
      AnalyzeFormula("(t > 0.3)*x1 + max(0, y1 - 1) + abs(x1)/t", {.states = 1, .constraints = 1}, 0, 1);
  ASSERT_TRUE(analyzed.ok());
  EXPECT_THAT((*analyzed)->switching.times, ElementsAre(0.3));
  EXPECT_EQ((*analyzed)->switching.refusal, "");
}

}  // namespace
}  // namespace dlcs
