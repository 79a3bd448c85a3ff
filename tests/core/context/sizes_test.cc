// SPDX-License-Identifier: Apache-2.0
// The definition in the header, case by case, and what must not depend on units.

#include "core/context/sizes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace dlcs {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kSizesTolerance = 1e-6;

Component SizesState(Index i) { return {ComponentKind::kState, i}; }

// One state with these figures, beside `size`, judged for a tolerance of 1e-6.
struct SizesCase {
  double own, truncation, rounding;
  double beside = 1;
};

Accuracy JudgeStates(const std::vector<SizesCase>& cases, const Options& options = {},
                     double tolerance = kSizesTolerance, int* calls = nullptr) {
  const auto m = static_cast<Index>(cases.size());
  Accuracy accuracy;
  accuracy.tolerance = tolerance;
  accuracy.errors.x = {Vector(m), Vector(m), Vector(m)};
  AllSizesBeside sizes;
  SizesBeside& beside = sizes.of(ComponentKind::kState);
  beside.size.resize(m);
  for (Index i = 0; i < m; ++i) {
    const SizesCase& c = cases[static_cast<std::size_t>(i)];
    accuracy.errors.x.own[i] = c.own;
    accuracy.errors.x.truncation[i] = c.truncation;
    accuracy.errors.x.rounding[i] = c.rounding;
    beside.size[i] = c.beside;
    beside.beside.emplace_back(SizesState(i));
  }
  JudgeComponents(
      options,
      [&] {
        if (calls) ++*calls;
        return sizes;
      },
      accuracy);
  return accuracy;
}

// What is known of one state; kKnown where it is not named.
Knowledge KnowledgeOf(const SizesCase& of, const Options& options = {}) {
  const Accuracy accuracy = JudgeStates({of}, options);
  return accuracy.named.empty() ? Knowledge::kKnown : accuracy.named[0].knowledge;
}

Options SizesGiven(double absolute) {
  Options options;
  options.absolute_tolerance = absolute;
  return options;
}

TEST(SizesTest, KnownIsTruncationAndRoundingTogetherWithinTheTolerance) {
  EXPECT_EQ(KnowledgeOf({2, 1.0e-6, 0.9e-6}), Knowledge::kKnown);
  EXPECT_EQ(KnowledgeOf({2, 1.1e-6, 1.0e-6}), Knowledge::kMissed);
  // Truncation is held to the own size, not to what stands beside.
  EXPECT_EQ(KnowledgeOf({2, 2.1e-6, 0, 1e9}), Knowledge::kMissed);
}

TEST(SizesTest, GivenIsAnErrorOfAtMostTheAbsoluteTolerance) {
  EXPECT_EQ(KnowledgeOf({1e-9, 4e-5, 5e-5}, SizesGiven(1e-4)), Knowledge::kKnown);
  EXPECT_EQ(KnowledgeOf({1e-9, 6e-5, 5e-5}, SizesGiven(1e-4)), Knowledge::kMissed);
}

// The rounding of what follows is twice that of its samples.
TEST(SizesTest, NegligibleIsSmallWithAnErrorOfRoundingAlone) {
  // Known to two digits, 1e-7 beside 1.
  EXPECT_EQ(KnowledgeOf({1e-7, 0, 1e-9}), Knowledge::kNegligible);
  EXPECT_EQ(KnowledgeOf({1e-7, 1.9e-9, 1e-9}), Knowledge::kNegligible);
  EXPECT_EQ(KnowledgeOf({1e-7, 2.1e-9, 1e-9}), Knowledge::kMissed);   // truncation
  EXPECT_EQ(KnowledgeOf({1e-5, 0, 1e-9}), Knowledge::kMissed);        // not small
  EXPECT_EQ(KnowledgeOf({1e-7, 0, 1e-9, 1e-2}), Knowledge::kMissed);  // beside something small
  EXPECT_EQ(KnowledgeOf({1e-7, 0, 1e-9}, SizesGiven(1e-10)), Knowledge::kMissed);
}

TEST(SizesTest, ZeroIsNoLargerThanTwiceItsRounding) {
  EXPECT_EQ(KnowledgeOf({1.9e-9, 0, 1e-9}), Knowledge::kZero);
  EXPECT_EQ(KnowledgeOf({2.1e-9, 0, 1e-9}), Knowledge::kNegligible);
  EXPECT_EQ(KnowledgeOf({1.9e-9, 2.1e-9, 1e-9}), Knowledge::kMissed);     // truncation
  EXPECT_EQ(KnowledgeOf({1.9e-9, 0, 1e-9, 1.9e-3}), Knowledge::kMissed);  // rounding that is not small
  // Nothing but a zero of zero rounding: its error of 0 is known.
  EXPECT_EQ(KnowledgeOf({0, 0, 0}), Knowledge::kKnown);
  // Too large an error for what is given, and still no more than rounding.
  EXPECT_EQ(KnowledgeOf({1.9e-9, 0, 1e-9}, SizesGiven(1e-10)), Knowledge::kZero);
}

TEST(SizesTest, AnErrorThatIsNoNumberIsMissed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(KnowledgeOf({1, nan, 0}), Knowledge::kMissed);
  EXPECT_EQ(KnowledgeOf({1, 0, nan}), Knowledge::kMissed);
  EXPECT_TRUE(std::isnan(JudgeStates({{1, nan, 0}, {1, 1e-9, 0}}).error));
  EXPECT_EQ(KnowledgeOf({1, std::numeric_limits<double>::infinity(), 0}), Knowledge::kMissed);
}

TEST(SizesTest, TheFigureIsTheLargestErrorBesideWhatItIsComparedWith) {
  // Relative errors of 1e-7 and 3e-7; the zero and the negligible one do not count.
  const Accuracy accuracy = JudgeStates({{5, 5e-7, 0}, {2, 0, 6e-7}, {1e-9, 0, 1e-9}, {1e-8, 0, 1e-10}});
  EXPECT_NEAR(accuracy.error, 3e-7, 1e-12);
  EXPECT_THAT(accuracy.named, SizeIs(2));
  // With an absolute tolerance an own size of 1e-3 is compared with 1e-5 / 1e-6 = 10.
  EXPECT_NEAR(JudgeStates({{1e-3, 4e-6, 0}}, SizesGiven(1e-5)).error, 4e-7, 1e-12);
  // What missed says what it was allowed.
  const Accuracy missed = JudgeStates({{3, 1e-3, 0}});
  ASSERT_THAT(missed.named, SizeIs(1));
  EXPECT_NEAR(missed.named[0].allowed, 3e-6, 1e-12);
  EXPECT_NEAR(missed.error, 1e-3 / 3, 1e-9);
}

TEST(SizesTest, ANegligibleComponentHasTheDigitsAboveItsRounding) {
  for (int digits = 1; digits <= 6; ++digits) {
    const double of_samples = 0.45e-12 * std::pow(10.0, -digits);
    const Accuracy accuracy = JudgeStates({{1e-12, 0, of_samples}}, {}, 1e-9);
    ASSERT_THAT(accuracy.named, SizeIs(1)) << digits;
    EXPECT_EQ(accuracy.named[0].digits, digits);
    EXPECT_EQ(accuracy.named[0].rounding, 2 * of_samples);
  }
}

TEST(SizesTest, TheWorstOfWhatMissedComesFirstBehindWhatIsAccepted) {
  const Accuracy accuracy = JudgeStates({{1, 1e-5, 0}, {1, 1e-2, 0}, {1e-9, 0, 1e-9}, {1, 1e-3, 0}, {1, 1e-9, 0}});
  std::vector<Index> order;
  for (const NamedComponent& named : accuracy.named) order.push_back(named.component.index);
  EXPECT_THAT(order, ElementsAre(2, 1, 3, 0));
}

TEST(SizesTest, SizesAreAskedForOnlyWhereSomethingIsNeitherKnownNorGiven) {
  int calls = 0;
  JudgeStates({{1, 1e-9, 0}, {1e-9, 1e-9, 0}}, SizesGiven(1e-8), kSizesTolerance, &calls);
  EXPECT_EQ(calls, 0);
  JudgeStates({{1, 1e-9, 0}, {1e-9, 1e-9, 0}}, {}, kSizesTolerance, &calls);
  EXPECT_EQ(calls, 1);
}

TEST(SizesTest, AVerdictHasNoUnits) {
  const std::vector<SizesCase> cases = {{1, 1e-5, 0},    {1, 9e-7, 5e-8},    {1e-9, 0, 1e-9},
                                        {1e-7, 0, 1e-9}, {1e-7, 2e-9, 1e-9}, {1e-8, 1e-10, 1e-3}};
  for (const double unit : {1e-150, 3e-7, 7e9, 1e150}) {
    for (const SizesCase& c : cases) {
      const SizesCase other{unit * c.own, unit * c.truncation, unit * c.rounding, unit * c.beside};
      EXPECT_EQ(KnowledgeOf(other), KnowledgeOf(c)) << unit << ": " << c.own;
      EXPECT_EQ(KnowledgeOf(other, SizesGiven(2e-9 * unit)), KnowledgeOf(c, SizesGiven(2e-9))) << unit;
    }
  }
}

TEST(SizesTest, GivenStepsMissOnlyStatesOfWhichNoDigitIsKnown) {
  // Every second of them has an error of more than half of it.
  Accuracy accuracy;
  accuracy.tolerance = 0;
  for (const ComponentKind kind : kComponentKinds) {
    accuracy.errors.of(kind) = {Vector{{1, 1}}, Vector{{0.4, 0.6}}, Vector::Zero(2)};
  }
  JudgeComponents(
      {}, [] { return AllSizesBeside{}; }, accuracy);
  ASSERT_THAT(accuracy.named, SizeIs(2));
  for (const NamedComponent& named : accuracy.named) {
    EXPECT_EQ(named.component.index, 1);
    EXPECT_TRUE(named.component.kind == ComponentKind::kState || named.component.kind == ComponentKind::kOutput);
  }
}

// Errors of up to 2 rounding + max(truncation, 2 rounding) are what other steps may have.
TEST(SizesTest, TheAdvisedTolerancesAcceptWhatOtherStepsMayHave) {
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> exponent(-12, 0);
  int missed = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<SizesCase> cases;
    for (int i = 0; i < 4; ++i) {
      const double own = std::pow(10.0, exponent(engine));
      const double beside = std::max(own, std::pow(10.0, exponent(engine)));
      cases.push_back({own, own * std::pow(10.0, exponent(engine)), own * std::pow(10.0, exponent(engine)), beside});
    }
    const Accuracy accuracy = JudgeStates(cases);
    if (accuracy.named.empty() || accuracy.named.back().knowledge != Knowledge::kMissed) continue;
    ++missed;
    std::vector<SizesCase> others = cases;
    for (SizesCase& other : others) {
      other.truncation = std::max(other.truncation, 2 * other.rounding);
      other.rounding *= 2;
    }
    const auto none_missed = [](const Accuracy& judged) {
      return std::none_of(judged.named.begin(), judged.named.end(),
                          [](const NamedComponent& named) { return named.knowledge == Knowledge::kMissed; });
    };
    const double slack = 1 + 1e-12;
    EXPECT_GT(accuracy.advice.tolerance, kSizesTolerance);
    EXPECT_TRUE(none_missed(JudgeStates(others, {}, slack * accuracy.advice.tolerance))) << trial;
    Options options;
    for (const auto& of : accuracy.advice.absolute) {
      options.absolute_tolerances.push_back({of.component, slack * of.tolerance});
    }
    EXPECT_TRUE(none_missed(JudgeStates(others, options))) << trial;
  }
  EXPECT_GT(missed, 100);
}

TEST(SizesTest, TheToleranceOfAComponentTakesThePlaceOfTheGeneralOne) {
  Options options;
  options.absolute_tolerances = {{{ComponentKind::kPair, 1}, 3e-4}};
  EXPECT_EQ(AbsoluteToleranceOf(options, {ComponentKind::kPair, 1}), 3e-4);
  EXPECT_EQ(AbsoluteToleranceOf(options, {ComponentKind::kPair, 0}), std::nullopt);
  EXPECT_EQ(AbsoluteToleranceOf(options, {ComponentKind::kSlack, 1}), std::nullopt);
  EXPECT_EQ(AbsoluteTolerances(options, ComponentKind::kPair, 3), (Vector{{0, 3e-4, 0}}));
  options.absolute_tolerance = 1e-2;  // larger, and smaller
  options.absolute_tolerances.push_back({{ComponentKind::kPair, 2}, 1});
  EXPECT_EQ(AbsoluteTolerances(options, ComponentKind::kPair, 3), (Vector{{1e-2, 3e-4, 1}}));
  EXPECT_EQ(AbsoluteTolerances(options, ComponentKind::kPair, 2), (Vector{{1e-2, 3e-4}}));
  EXPECT_EQ(AbsoluteTolerances(options, ComponentKind::kPair, 0).size(), 0);
  EXPECT_EQ(AbsoluteTolerances(options, ComponentKind::kSlack, 2), (Vector{{1e-2, 1e-2}}));
  EXPECT_EQ(AbsoluteToleranceOf(options, {ComponentKind::kSlack, 1}), 1e-2);
}

TEST(SizesTest, StepsSeeToTruncationDownToRoundingAndNoFurther) {
  TrajectoryErrors errors;
  errors.x = {Vector{{2}}, Vector{{1e-4}}, Vector{{4e-7}}};
  EXPECT_NEAR(ExcessOfTruncation(errors, {}, kSizesTolerance), 1e-4 / 1.6e-6, 1e-6);
  EXPECT_NEAR(ExcessOfTruncation(errors, SizesGiven(5e-6), kSizesTolerance), 1e-4 / 4.6e-6, 1e-6);
  errors.x.rounding[0] = 1.5e-6;  // more than is left of 2e-6
  EXPECT_NEAR(ExcessOfTruncation(errors, {}, kSizesTolerance), 1e-4 / 1.5e-6, 1e-6);
  errors.x.truncation[0] = 0;
  errors.x.own[0] = errors.x.rounding[0] = 0;
  EXPECT_EQ(ExcessOfTruncation(errors, {}, kSizesTolerance), 0);
  // Of several kinds the worst.
  errors.w = {Vector{{1}}, Vector{{7e-6}}, Vector{{0}}};
  EXPECT_NEAR(ExcessOfTruncation(errors, {}, kSizesTolerance), 7, 1e-9);
}

ErrorsByCause SizesErrors(Vector own, Vector rounding) {
  Vector none = Vector::Zero(own.size());
  return {std::move(own), std::move(none), std::move(rounding)};
}

RowMajorMatrix SizesSparse(const Matrix& matrix) { return matrix.sparseView(); }

TEST(SizesTest, OwnSizesStandBesideThemselves) {
  const SizesBeside sizes = OwnSizes(SizesErrors(Vector{{2, 5}}, Vector{{0, 0}}), ComponentKind::kPair);
  EXPECT_EQ(sizes.size, (Vector{{2, 5}}));
  EXPECT_THAT(sizes.beside, ElementsAre(Component{ComponentKind::kPair, 0}, Component{ComponentKind::kPair, 1}));
}

// x1' = a x2, x2' = -b x1: the energy b x1² + a x2² is constant, so x1 of size 1 stands beside x2 of size sqrt(b/a).
TEST(SizesTest, AnOscillatorHasTheSizesOfItsEnergy) {
  const double a = 7e5, b = 3e-2;
  const RowMajorMatrix dynamics = SizesSparse(Matrix{{0, a}, {-b, 0}});
  const Vector none = Vector::Zero(2);
  SizesBeside sizes = StatesBeside(dynamics, none, 2, SizesErrors(Vector{{4, 1e-9}}, none));
  EXPECT_NEAR(sizes.size[0], 4, 1e-9);
  EXPECT_NEAR(sizes.size[1] / (4 * std::sqrt(b / a)), 1, 2e-3);
  EXPECT_EQ(sizes.beside[1], SizesState(0));
  sizes = StatesBeside(dynamics, none, 2, SizesErrors(Vector{{1e-9, 4}}, none));
  EXPECT_NEAR(sizes.size[0] / (4 * std::sqrt(a / b)), 1, 2e-3);
  EXPECT_EQ(sizes.beside[0], SizesState(1));
}

TEST(SizesTest, WhatOnlyFeedsOrReceivesHasItsOwnSize) {
  const RowMajorMatrix dynamics = SizesSparse(Matrix{{-1, 0, 0}, {5, -2, 0}, {0, 8, -3}});
  const Vector own{{1e3, 1e-5, 2}};
  const SizesBeside sizes = StatesBeside(dynamics, Vector::Ones(3), 1, SizesErrors(own, Vector::Zero(3)));
  EXPECT_EQ(sizes.size, own);
  for (Index i = 0; i < 3; ++i) EXPECT_EQ(sizes.beside[static_cast<std::size_t>(i)], SizesState(i));
}

// x1 is no more than its rounding, by x0 and the source: (|A10| R0 + β) / (1/T + |A11|).
TEST(SizesTest, AStateOfRoundingHasTheSizeOfWhatEnters) {
  const RowMajorMatrix dynamics = SizesSparse(Matrix{{-1, 0}, {5, -3}});
  const ErrorsByCause states = SizesErrors(Vector{{10, 1e-16}}, Vector{{0, 1e-16}});
  SizesBeside sizes = StatesBeside(dynamics, Vector{{0, 7}}, 0.5, states);
  EXPECT_NEAR(sizes.size[1], (5 * 10 + 7) / (2.0 + 3), 1e-12);
  EXPECT_EQ(sizes.beside[1], SizesState(0));
  sizes = StatesBeside(dynamics, Vector{{0, 70}}, 0.5, states);
  EXPECT_NEAR(sizes.size[1], (5 * 10 + 70) / (2.0 + 3), 1e-12);
  EXPECT_EQ(sizes.beside[1], std::nullopt);  // the source is the larger part
  // One that is more than its rounding does not look at what enters.
  sizes = StatesBeside(dynamics, Vector{{0, 7}}, 0.5, SizesErrors(Vector{{10, 3e-16}}, Vector{{0, 1e-16}}));
  EXPECT_NEAR(sizes.size[1], 3e-16, 1e-27);
}

TEST(SizesTest, OtherUnitsOfStatesAndTimeGiveTheSameSizes) {
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 30; ++trial) {
    const Index m = 5;
    Matrix A = Matrix::NullaryExpr(m, m, [&] { return normal(engine); });
    if (trial % 2) A.topRightCorner(2, 3).setZero();  // two blocks
    const Vector own = Vector::NullaryExpr(m, [&] { return std::exp(4 * normal(engine)); });
    Vector rounding = Vector::Zero(m);
    if (trial % 3 == 0) rounding = own;
    const Vector sources = Vector::NullaryExpr(m, [&] { return std::exp(normal(engine)); });
    const Vector units = Vector::NullaryExpr(m, [&] { return std::exp(6 * normal(engine)); });
    const double time = 1234.5;
    const Matrix other = units.asDiagonal() * A * units.cwiseInverse().asDiagonal() / time;
    const Vector R = StatesBeside(SizesSparse(A), sources, 2, SizesErrors(own, rounding)).size;
    const Vector other_R = StatesBeside(SizesSparse(other), units.cwiseProduct(sources) / time, 2 * time,
                                        SizesErrors(units.cwiseProduct(own), units.cwiseProduct(rounding)))
                               .size;
    for (Index i = 0; i < m; ++i) {
      EXPECT_NEAR(other_R[i] / units[i] / R[i], 1, 1e-2) << trial;
      EXPECT_GE(R[i], own[i]);
    }
  }
}

TEST(SizesTest, AFunctionOfStatesHasTheSumOfTheirSizes) {
  const SizesBeside states = OwnSizes(SizesErrors(Vector{{3, 50}}, Vector{{0, 0}}), ComponentKind::kState);
  const RowMajorMatrix rows = SizesSparse(Matrix{{-2, 0.5}, {4, 0}, {1, 0}});
  const Vector of_sources{{1000, 1000, 0}};
  const ErrorsByCause outputs = SizesErrors(Vector{{1, 1e-16, 9}}, Vector{{0, 1e-16, 0}});
  const SizesBeside sizes = RowsBeside(rows, states, ComponentKind::kOutput, outputs, of_sources);
  EXPECT_NEAR(sizes.size[0], 2 * 3 + 0.5 * 50, 1e-12);  // sources count only for rounding
  EXPECT_EQ(sizes.beside[0], SizesState(1));
  EXPECT_NEAR(sizes.size[1], 4 * 3 + 1000, 1e-12);
  EXPECT_EQ(sizes.beside[1], std::nullopt);
  EXPECT_EQ(sizes.size[2], 9);  // its own size is more than that of its terms
  EXPECT_EQ(sizes.beside[2], (Component{ComponentKind::kOutput, 2}));
}

TEST(SizesTest, OfSeveralModesTheLargestSizeCounts) {
  AllSizesBeside sizes, other;
  other.of(ComponentKind::kState) = {Vector{{1, 5}}, {SizesState(0), SizesState(1)}};
  sizes.RaiseTo(other);
  EXPECT_EQ(sizes.of(ComponentKind::kState).size, (Vector{{1, 5}}));
  other.of(ComponentKind::kState) = {Vector{{3, 2}}, {std::nullopt, SizesState(0)}};
  sizes.RaiseTo(other);
  EXPECT_EQ(sizes.of(ComponentKind::kState).size, (Vector{{3, 5}}));
  EXPECT_THAT(sizes.of(ComponentKind::kState).beside, ElementsAre(std::nullopt, SizesState(1)));
  EXPECT_THAT(sizes.of(ComponentKind::kPair).beside, IsEmpty());
}

}  // namespace
}  // namespace dlcs
