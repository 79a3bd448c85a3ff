// SPDX-License-Identifier: Apache-2.0
#include "core/problem/source_periods.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "core/problem/formula_syntax.h"
#include "core/problem/time_function.h"

namespace dlcs {
namespace {

constexpr double kPi = std::numbers::pi;

std::optional<double> Period(const std::string& text) {
  const auto tree = ReadFormula(text);
  EXPECT_TRUE(tree.ok()) << tree.status();
  return PeriodOf(*tree);
}

TEST(PeriodOfTest, FollowsOperations) {
  EXPECT_EQ(Period("3"), 0);
  EXPECT_NEAR(*Period("sin(2*pi*50*t)"), 0.02, 1e-15);
  EXPECT_NEAR(*Period("3 - 2*cos(4*t + 1)"), kPi / 2, 1e-14);
  EXPECT_NEAR(*Period("tan(t)"), kPi, 1e-14);
  EXPECT_NEAR(*Period("abs(sin(t))"), 2 * kPi, 1e-14);  // a multiple of the smallest
  EXPECT_NEAR(*Period("sin(t + 0.1*sin(2*t))"), 2 * kPi, 1e-14);
  EXPECT_NEAR(*Period("t - 3*floor(t/3)"), 3, 1e-14);
  EXPECT_NEAR(*Period("(t/0.02 - floor(t/0.02) < 0.4)"), 0.02, 1e-15);
  EXPECT_NEAR(*Period("sin(2*t)*cos(3*t)"), 2 * kPi, 1e-13);
  EXPECT_NEAR(*Period("max(0, sin(2*pi*t/3)) + sin(2*pi*t/7)"), 21, 1e-12);
}

TEST(PeriodOfTest, IsThatFromSomeTimeOn) {
  EXPECT_NEAR(*Period("(t >= 1)*sin(t)"), 2 * kPi, 1e-14);
  EXPECT_NEAR(*Period("sin(max(0, t - 1))"), 2 * kPi, 1e-14);
  EXPECT_EQ(Period("(t < 4)"), 0);
}

TEST(PeriodOfTest, KnowsWhereThereIsNone) {
  EXPECT_FALSE(Period("t"));
  EXPECT_FALSE(Period("exp(-t)"));
  EXPECT_FALSE(Period("sin(t*t)"));
  EXPECT_FALSE(Period("sin(t) + sin(sqrt(2)*t)"));
}

Problem WithSource(TimeFunction f, double horizon = 10) {
  Problem problem;
  problem.A = -Matrix::Identity(1, 1);
  problem.B = Matrix::Zero(1, 1);
  problem.N = Matrix::Zero(1, 1);
  problem.M = Matrix::Identity(1, 1);
  problem.f = std::move(f);
  problem.g = TimeFunction::Constant(Vector::Ones(1));
  problem.x0 = Vector::Zero(1);
  problem.horizon = horizon;
  return problem;
}

std::vector<Violation> Check(const Problem& problem, double period) {
  Options options;
  options.period = period;
  return CheckPeriod(problem, options);
}

TEST(CheckPeriodTest, AMultipleOfThePeriodIsOne) {
  const Problem problem = WithSource(TimeFunction::Formulas({"sin(2*pi*t/0.5)"}));
  for (const double period : {0.5, 1.0, 2.5}) EXPECT_TRUE(Check(problem, period).empty()) << period;
}

TEST(CheckPeriodTest, NamesTheSourceAndItsPeriod) {
  const std::vector<Violation> violations = Check(WithSource(TimeFunction::Formulas({"sin(2*pi*t/0.5)"})), 0.7);
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].field, "period");
  EXPECT_EQ(violations[0].description,
            "0.7; must be a multiple of the period of every source, and that of f[0] is 0.5");
}

TEST(CheckPeriodTest, ShowsTwoValuesOfASourceWithoutAPeriod) {
  const std::vector<Violation> violations = Check(WithSource(TimeFunction::Formulas({"t"})), 1);
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_NE(violations[0].description.find("one period later"), std::string::npos) << violations[0].description;
}

// A pulse of a hundred thousandth of the period.
TEST(CheckPeriodTest, SeesAShortPulse) {
  EXPECT_TRUE(Check(WithSource(TimeFunction::Formulas({"(t - floor(t) < 1e-5)"})), 1).empty());
  EXPECT_FALSE(Check(WithSource(TimeFunction::Formulas({"(t/2 - floor(t/2) < 5e-6)"})), 1).empty());
}

TEST(CheckPeriodTest, SamplesUpToThePeriodAreOnePeriod) {
  const TimeFunction samples = TimeFunction::Sampled({0, 0.4, 1}, Matrix{{0, 1, 0}});
  EXPECT_TRUE(Check(WithSource(samples, 1), 1).empty());
  EXPECT_FALSE(Check(WithSource(samples, 1.5), 1).empty());  // the second period is not known
  // Here it is: from 1 on the samples are constant, and so is every period.
  EXPECT_TRUE(Check(WithSource(samples, 4), 1).empty());
  EXPECT_EQ(ProblemOfOnePeriod(WithSource(samples, 4), 1).phase, 1);
}

TEST(CheckPeriodTest, AnOscillationToBeFoundHasConstantSources) {
  EXPECT_TRUE(Check(WithSource(TimeFunction::Formulas({"2"})), Options::kFindPeriod).empty());
  EXPECT_FALSE(Check(WithSource(TimeFunction::Formulas({"sin(t)"})), Options::kFindPeriod).empty());
}

TEST(OnePeriodTest, BeginsWhereTheSourcesRepeat) {
  const Problem problem = WithSource(TimeFunction::Formulas({"(t >= 1.5)*sin(2*pi*t)"}));
  EXPECT_TRUE(Check(problem, 1).empty());
  const OnePeriod one = ProblemOfOnePeriod(problem, 1);
  EXPECT_EQ(one.phase, 2);
  EXPECT_EQ(one.problem.horizon, 1);
  auto f = TimeFunctionEvaluator::Create(one.problem.f, 1);
  ASSERT_TRUE(f.ok()) << f.status();
  Vector value(1);
  f->Evaluate(0.25, Side::kRight, value);
  EXPECT_NEAR(value[0], 1, 1e-12);
}

// A jump between the multiples of the period at which values are compared.
TEST(OnePeriodTest, BeginsBehindTheLastJumpInTheHorizon) {
  for (const double jump : {2.5, 10.25, 99.75, 517.5}) {
    const std::string step = "sin(2*pi*t) + (t > " + std::to_string(jump) + ")";
    const Problem problem = WithSource(TimeFunction::Formulas({step}), 1000);
    EXPECT_TRUE(Check(problem, 1).empty()) << jump;
    EXPECT_EQ(ProblemOfOnePeriod(problem, 1).phase, std::ceil(jump)) << jump;
  }
}

}  // namespace
}  // namespace dlcs
