// SPDX-License-Identifier: Apache-2.0
#include "core/problem/time_function.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/non_finite.h"

namespace dlcs {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kInfinity;
using testing::kNaN;
using ::testing::SizeIs;

TimeFunctionEvaluator Compiled(const TimeFunction& function, Index size) {
  absl::StatusOr<TimeFunctionEvaluator> evaluator = TimeFunctionEvaluator::Create(function, size);
  EXPECT_TRUE(evaluator.ok()) << evaluator.status();
  return std::move(evaluator).value();
}

Vector ValueAt(TimeFunctionEvaluator& evaluator, double t, Side side) {
  Vector value = Vector::Constant(evaluator.size(), kNaN);
  evaluator.Evaluate(t, side, value);
  return value;
}

double ScalarAt(TimeFunctionEvaluator& evaluator, double t, Side side = Side::kRight) {
  return ValueAt(evaluator, t, side)(0);
}

// "field: description" of every violation.
std::vector<std::string> Complaints(const TimeFunction& function, Index size) {
  std::vector<std::string> complaints;
  for (const Violation& violation : Validate(function, size, "f")) {
    complaints.push_back(violation.field + ": " + violation.description);
  }
  return complaints;
}

Matrix Row(std::initializer_list<double> values) {
  Matrix row(1, static_cast<Index>(values.size()));
  Index k = 0;
  for (const double value : values) row(0, k++) = value;
  return row;
}

// 1 before t = 1, then 10 t, then from t = 2 on samples from 5 at 2 to 9 at 4, then from t = 5 on a
// polynomial: 7 + (t - 5)^2 up to 6 and 3 - (t - 6) after it. Its break at 4 is before its piece begins.
TimeFunction FourPieces() {
  TimeFunction function = TimeFunction::Constant(Vector::Constant(1, 1.0));
  function.pieces.push_back({1, FormulaFunction{{"10*t"}}});
  function.pieces.push_back({2, SampledFunction{{2, 4}, Row({5, 9})}});
  function.pieces.push_back(
      {5, PiecewisePolynomial{{3, 4, 5, 6, 9}, {Row({-1}), Row({-2}), Row({7, 0, 1}), Row({3, -1})}}});
  return function;
}

TEST(TimeFunctionTest, TakesTheLimitFromTheAskedSide) {
  TimeFunctionEvaluator f = Compiled(FourPieces(), 1);
  struct Jump {
    double time;
    double left;
    double right;
  };
  for (const Jump& jump : {Jump{1, 1, 10}, Jump{2, 20, 5}, Jump{5, 9, 7}, Jump{6, 8, 3}}) {
    EXPECT_EQ(ScalarAt(f, jump.time, Side::kLeft), jump.left) << jump.time;
    EXPECT_EQ(ScalarAt(f, jump.time, Side::kRight), jump.right) << jump.time;
  }
}

TEST(TimeFunctionTest, TakesTheSameValueFromBothSidesWhereItIsContinuous) {
  TimeFunctionEvaluator f = Compiled(FourPieces(), 1);
  for (const Side side : {Side::kLeft, Side::kRight}) {
    EXPECT_EQ(ScalarAt(f, -3, side), 1);
    EXPECT_EQ(ScalarAt(f, std::nextafter(1.0, 0.0), side), 1);
    EXPECT_EQ(ScalarAt(f, 1.5, side), 15);
    EXPECT_EQ(ScalarAt(f, 2.5, side), 6);
    EXPECT_EQ(ScalarAt(f, 4, side), 9);
    EXPECT_EQ(ScalarAt(f, 4.5, side), 9);
    EXPECT_EQ(ScalarAt(f, 5.5, side), 7.25);
    EXPECT_EQ(ScalarAt(f, 9, side), 0);
    EXPECT_EQ(ScalarAt(f, 100, side), -91);
  }
}

// The place of the last look-up is only a hint.
TEST(TimeFunctionTest, GivesTheSameValuesInAnyOrderOfTimes) {
  std::vector<double> times;
  for (int k = -4; k <= 32; ++k) times.push_back(k / 4.0);
  for (const Side side : {Side::kLeft, Side::kRight}) {
    TimeFunctionEvaluator kept = Compiled(FourPieces(), 1);
    for (std::size_t i = 0; i < 5 * times.size(); ++i) {
      const double t = times[i * 17 % times.size()];
      TimeFunctionEvaluator fresh = Compiled(FourPieces(), 1);
      EXPECT_EQ(ScalarAt(kept, t, side), ScalarAt(fresh, t, side)) << t;
    }
  }
}

TEST(TimeFunctionTest, ListsOnlyTheBreaksThatAPieceLivesToSee) {
  EXPECT_THAT(BreakPoints(FourPieces(), 10), ElementsAre(1, 2, 5, 6));
  EXPECT_THAT(BreakPoints(FourPieces(), 5.5), ElementsAre(1, 2, 5));
  EXPECT_THAT(BreakPoints(FourPieces(), 5), ElementsAre(1, 2));
  EXPECT_THAT(BreakPoints(TimeFunction::Zero(3), 5), IsEmpty());
  TimeFunction early = TimeFunction::Zero(1);
  early.pieces.front().start = -2;
  early.pieces.push_back({-1, ConstantFunction{Vector::Zero(1)}});
  early.pieces.push_back({0, ConstantFunction{Vector::Ones(1)}});
  EXPECT_THAT(BreakPoints(early, 5), IsEmpty());
  TimeFunctionEvaluator f = Compiled(early, 1);
  EXPECT_EQ(ScalarAt(f, 0), 1);
}

TEST(TimeFunctionTest, ExtendsPolynomialsToBothSides) {
  TimeFunction function = TimeFunction::Zero(1);
  function.pieces.front().function = PiecewisePolynomial{{0, 1, 2}, {Row({1, 1}), Row({5, 0, 2})}};
  TimeFunctionEvaluator f = Compiled(function, 1);
  EXPECT_EQ(ScalarAt(f, -2), -1);
  EXPECT_EQ(ScalarAt(f, 1, Side::kLeft), 2);
  EXPECT_EQ(ScalarAt(f, 1, Side::kRight), 5);
  EXPECT_EQ(ScalarAt(f, 4), 5 + 2 * 9);
  EXPECT_THAT(BreakPoints(function, 10), ElementsAre(1));
}

TEST(TimeFunctionTest, InterpolatesSamplesAndHitsThemExactly) {
  Matrix values(2, 4);
  values << 0.1, 0.7, -0.3, 1e17, 1, 2, 3, 4;
  const std::vector<double> times = {0.1, 0.2, 0.7, 3.3};
  TimeFunctionEvaluator f = Compiled(TimeFunction::Sampled(times, values), 2);
  for (Index k = 0; k < 4; ++k) {
    for (const Side side : {Side::kLeft, Side::kRight}) {
      EXPECT_EQ(ValueAt(f, times[static_cast<std::size_t>(k)], side), values.col(k)) << k;
    }
  }
  EXPECT_EQ(ValueAt(f, -5, Side::kRight), values.col(0));
  EXPECT_EQ(ValueAt(f, 50, Side::kRight), values.col(3));
  EXPECT_NEAR(ValueAt(f, 0.45, Side::kRight)(1), 2.5, 1e-15);
  EXPECT_NEAR(ValueAt(f, 0.125, Side::kRight)(0), 0.25, 1e-15);
}

TEST(TimeFunctionTest, HoldsASingleSampleForEver) {
  TimeFunctionEvaluator f = Compiled(TimeFunction::Sampled({2}, Row({6})), 1);
  EXPECT_EQ(ScalarAt(f, 0), 6);
  EXPECT_EQ(ScalarAt(f, 2), 6);
  EXPECT_EQ(ScalarAt(f, 3), 6);
}

TEST(TimeFunctionTest, MixesConstantAndVaryingFormulas) {
  TimeFunctionEvaluator f = Compiled(TimeFunction::Formulas({"2.5", "t", "0", "t**2", "-pi"}), 5);
  Vector expected(5);
  expected << 2.5, 3, 0, 9, -3.141592653589793;
  EXPECT_EQ(ValueAt(f, 3, Side::kRight), expected);
  expected << 2.5, -1, 0, 1, -3.141592653589793;
  EXPECT_EQ(ValueAt(f, -1, Side::kLeft), expected);
}

TEST(TimeFunctionTest, WritesIntoAColumnOfAMatrix) {
  TimeFunctionEvaluator f = Compiled(TimeFunction::Formulas({"t", "2*t"}), 2);
  Matrix values = Matrix::Zero(2, 3);
  f.Evaluate(4, Side::kRight, values.col(1));
  EXPECT_EQ(values.col(1), Vector({{4, 8}}));
  EXPECT_EQ(values.col(2), Vector({{0, 0}}));
}

TEST(TimeFunctionTest, PassesNonFiniteValuesOn) {
  TimeFunctionEvaluator f = Compiled(TimeFunction::Formulas({"log(t)", "sqrt(t)"}), 2);
  EXPECT_EQ(ValueAt(f, 0, Side::kRight)(0), -kInfinity);
  EXPECT_TRUE(std::isnan(ValueAt(f, -1, Side::kRight)(1)));
}

TEST(TimeFunctionTest, WorksAfterAMove) {
  TimeFunctionEvaluator first = Compiled(TimeFunction::Formulas({"t + 1"}), 1);
  TimeFunctionEvaluator second = std::move(first);
  first = Compiled(FourPieces(), 1);
  EXPECT_EQ(ScalarAt(second, 1), 2);
  EXPECT_EQ(ScalarAt(first, 1), 10);
}

TEST(TimeFunctionTest, FindsNothingWrongWithSoundFunctions) {
  EXPECT_THAT(Complaints(FourPieces(), 1), IsEmpty());
  EXPECT_THAT(Complaints(TimeFunction::Zero(3), 3), IsEmpty());
  EXPECT_THAT(Complaints(TimeFunction::Formulas({"t", "log(t)"}), 2), IsEmpty());
}

TEST(TimeFunctionTest, NamesWhatIsWrongWithAConstant) {
  EXPECT_THAT(Complaints(TimeFunction::Constant(Vector({{1, kNaN, 2, -kInfinity}})), 3),
              ElementsAre("f: 4 components; must be 3, one for each state", "f[1]: nan; every entry must be finite",
                          "f[3]: -inf; every entry must be finite"));
}

TEST(TimeFunctionTest, NamesWhatIsWrongWithFormulas) {
  EXPECT_THAT(Complaints(TimeFunction::Formulas({"t", "2t", "sine(t)"}), 2),
              ElementsAre("f: 3 components; must be 2, one for each state",
                          "f[1]: at position 2: found 't'; an operator is expected here, and a product is written "
                          "with *, as in 2*t",
                          "f[2]: at position 1: unknown name 'sine'; did you mean 'sin'?"));
}

TEST(TimeFunctionTest, NamesWhatIsWrongWithSamples) {
  EXPECT_THAT(Complaints(TimeFunction::Sampled({}, Matrix(1, 0)), 1),
              ElementsAre("f.times: empty; must hold at least one time"));
  EXPECT_THAT(
      Complaints(TimeFunction::Sampled({0, 1, 1, kNaN, 0.5}, Row({1, 2, 3, kInfinity})), 2),
      ElementsAre("f.times[2]: 1; must be greater than the time before it, 1",
                  "f.times[3]: nan; every time must be finite", "f.values: 1x4; must be 2x5 (components x times)",
                  "f.values[0][3]: inf; every entry must be finite"));
  EXPECT_THAT(Complaints(TimeFunction::Sampled({0, 2, 1}, Row({1, 2, 3})), 1),
              ElementsAre("f.times[2]: 1; must be greater than the time before it, 2"));
}

TEST(TimeFunctionTest, NamesWhatIsWrongWithPolynomials) {
  TimeFunction function = TimeFunction::Zero(1);
  function.pieces.front().function = PiecewisePolynomial{};
  EXPECT_THAT(Complaints(function, 1), ElementsAre("f.coefficients: empty; must hold at least one polynomial",
                                                   "f.breaks: 0 times; must be 1, one more than the polynomials"));
  function.pieces.front().function = PiecewisePolynomial{{0, 2, 1}, {Row({1, kNaN}), Matrix(2, 0), Row({1})}};
  EXPECT_THAT(Complaints(function, 1), ElementsAre("f.breaks: 3 times; must be 4, one more than the polynomials",
                                                   "f.breaks[2]: 1; must be greater than the time before it, 2",
                                                   "f.coefficients[0][0][1]: nan; every entry must be finite",
                                                   "f.coefficients[1]: 2x0; must be 1x1 (components x powers)"));
}

TEST(TimeFunctionTest, NamesThePieceWhereThereAreSeveral) {
  TimeFunction function = TimeFunction::Zero(1);
  function.pieces.push_back({1, FormulaFunction{{"t="}}});
  function.pieces.push_back({1, SampledFunction{{0, 0}, Row({1, 2})}});
  function.pieces.push_back({kNaN, ConstantFunction{Vector::Zero(2)}});
  EXPECT_THAT(Complaints(function, 1),
              ElementsAre("f.pieces[1][0]: at position 2: found '='; a formula is one value and assigns nothing; write "
                          "== to compare",
                          "f.pieces[2].start: 1; must be greater than the start before it, 1",
                          "f.pieces[2].times[1]: 0; must be greater than the time before it, 0",
                          "f.pieces[3].start: nan; every time must be finite",
                          "f.pieces[3]: 2 components; must be 1, one for each state"));
  EXPECT_THAT(Complaints(TimeFunction{}, 1), ElementsAre("f: no pieces; a time function has at least one"));
}

TEST(TimeFunctionTest, CountsTheViolationsThatAreTooManyToList) {
  const std::vector<std::string> complaints = Complaints(TimeFunction::Constant(Vector::Constant(500, kNaN)), 500);
  ASSERT_THAT(complaints, SizeIs(201));
  EXPECT_EQ(complaints[199], "f[199]: nan; every entry must be finite");
  EXPECT_EQ(complaints[200], "f[200]: here and after it 300 more rules are broken");
}

TEST(TimeFunctionTest, RefusesToCompileWithTheFirstViolation) {
  const auto evaluator = TimeFunctionEvaluator::Create(TimeFunction::Formulas({"t", "1/"}), 3);
  EXPECT_EQ(evaluator.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(evaluator.status().message()), HasSubstr("function: 2 components; must be 3"));
}

// Shifted by whole periods, the operand of a floor is whole at 0 but for rounding: a part of the first interval is as
// short as that.
TEST(TimeFunctionTest, TheRoundingOfAGateIsThatOfItsValue) {
  for (const char* phase : {"t/0.1", "(t-0.1)/0.1", "(t+0.1)/0.1", "(t-1)/0.1", "(t-0.3)/0.1", "(t+1)", "(t-7)/0.7"}) {
    const std::string text = std::string("3*(") + phase + "-floor(" + phase + ")<0.25)";
    const TimeFunction function = TimeFunction::Formulas({text});
    const TimeAxis axis{1, BreakPoints(function, 1)};
    auto evaluator = TimeFunctionEvaluator::Create(function, 1, axis);
    ASSERT_TRUE(evaluator.ok()) << evaluator.status();
    Vector rounding(1);
    for (const double t : {0.005, 0.05, 0.51, 0.93}) {
      evaluator->RoundingAt(t, rounding);
      EXPECT_LT(rounding[0], 1e-14) << text << " at " << t;
    }
  }
}

// Also at the time itself, or within the rounding of it.
TEST(TimeFunctionTest, AJumpIsNoRounding) {
  const TimeFunction function = TimeFunction::Formulas({"3*cos(3*t)*sign(sin(3*t)) + 1"});
  const TimeAxis axis{2, BreakPoints(function, 2)};
  auto evaluator = TimeFunctionEvaluator::Create(function, 1, axis);
  ASSERT_TRUE(evaluator.ok()) << evaluator.status();
  Vector rounding(1);
  for (const double t : {0.0, 1e-17, axis.break_points.front(), 0.5, 2.0}) {
    evaluator->RoundingAt(t, rounding);
    EXPECT_LT(rounding[0], 1e-14) << t;
  }
}

// Of formulas, samples and constants, against the derivatives; not known at a jump that rounding hides.
TEST(TimeFunctionTest, SlopesHaveTheRoundingOfTheirTerms) {
  TimeFunction function = TimeFunction::Formulas({"exp(-2*t)*sin(5*t)", "abs(cos(3*t))", "7", "sqrt(t + 1)"});
  const TimeAxis axis{1, BreakPoints(function, 4)};
  auto evaluator = TimeFunctionEvaluator::Create(function, 4, axis);
  ASSERT_TRUE(evaluator.ok()) << evaluator.status();
  Vector slope(4), rounding(4);
  for (const double t : {0.1, 0.4, 0.77, 1.0}) {
    evaluator->SlopeAt(t, Side::kLeft, slope, rounding);
    const double side = std::cos(3 * t) < 0 ? -1 : 1;
    const Vector exact{{std::exp(-2 * t) * (5 * std::cos(5 * t) - 2 * std::sin(5 * t)), -3 * side * std::sin(3 * t), 0,
                        0.5 / std::sqrt(t + 1)}};
    EXPECT_LE((slope - exact).cwiseAbs().maxCoeff(), 1e-14) << t;
    EXPECT_LE(rounding.maxCoeff(), 1e-13) << t;
    EXPECT_TRUE(((slope - exact).array().abs() <= 2 * rounding.array() + 1e-15).all()) << t;
  }
  auto samples = TimeFunctionEvaluator::Create(TimeFunction::Sampled({0, 0.5, 2}, Matrix{{1, 3, 0}}), 1);
  ASSERT_TRUE(samples.ok());
  Vector of_samples(1), of_rounding(1);
  samples->SlopeAt(0.5, Side::kLeft, of_samples, of_rounding);
  EXPECT_DOUBLE_EQ(of_samples[0], 4);
  samples->SlopeAt(0.5, Side::kRight, of_samples, of_rounding);
  EXPECT_DOUBLE_EQ(of_samples[0], -2);
}

}  // namespace
}  // namespace dlcs
