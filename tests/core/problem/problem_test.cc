// SPDX-License-Identifier: Apache-2.0
#include "core/problem/problem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/non_finite.h"

namespace dlcs {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::kInfinity;
using testing::kNaN;
using ::testing::SizeIs;

// Two states, three complementary pairs.
Problem SoundProblem() {
  Problem problem;
  problem.A = Matrix::Identity(2, 2);
  problem.B = Matrix::Ones(2, 3);
  problem.N = Matrix::Ones(3, 2);
  problem.M = Matrix::Identity(3, 3);
  problem.f = TimeFunction::Formulas({"sin(t)", "0"});
  problem.g = TimeFunction::Zero(3);
  problem.x0 = Vector::Zero(2);
  problem.horizon = 4;
  return problem;
}

std::vector<std::string> Complaints(const Problem& problem) {
  std::vector<std::string> complaints;
  for (const Violation& violation : Validate(problem)) {
    complaints.push_back(violation.field + ": " + violation.description);
  }
  return complaints;
}

std::vector<std::string> ComplaintsAfter(const std::function<void(Problem&)>& change) {
  Problem problem = SoundProblem();
  change(problem);
  return Complaints(problem);
}

TEST(ProblemTest, FindsNothingWrongWithASoundProblem) { EXPECT_THAT(Complaints(SoundProblem()), IsEmpty()); }

TEST(ProblemTest, NamesEveryShapeThatDoesNotFit) {
  EXPECT_THAT(ComplaintsAfter([](Problem& p) { p.A = Matrix::Zero(2, 3); }),
              ElementsAre("A: 2x3; must be square, m x m for m states"));
  EXPECT_THAT(ComplaintsAfter([](Problem& p) { p.M = Matrix::Zero(3, 2); }),
              ElementsAre("M: 3x2; must be square, n x n for n complementary pairs"));
  EXPECT_THAT(ComplaintsAfter([](Problem& p) {
                p.B = Matrix::Zero(3, 2);
                p.N = Matrix::Zero(2, 2);
                p.x0 = Vector::Zero(1);
                p.g = TimeFunction::Zero(2);
              }),
              ElementsAre("B: 3x2; must be m x n = 2x3 (m from A, n from M)",
                          "N: 2x2; must be n x m = 3x2 (m from A, n from M)",
                          "g: 2 components; must be 3, one for each pair", "x0: 1 component; must be m = 2 (from A)"));
}

TEST(ProblemTest, WantsASelectorForTheMinimizerAndNobodyElse) {
  EXPECT_THAT(ComplaintsAfter([](Problem& p) { p.rule = SolutionRule::kMinimizer; }),
              ElementsAre("selector: missing; the rule minimizer needs C and b"));
  EXPECT_THAT(ComplaintsAfter([](Problem& p) {
                p.selector = Selector{Matrix::Ones(1, 3), Vector::Ones(1)};
              }),
              ElementsAre("selector: given; only the rule minimizer takes one"));
  EXPECT_THAT(ComplaintsAfter([](Problem& p) {
                p.rule = SolutionRule::kMinimizer;
                p.selector = Selector{Matrix::Ones(2, 2), Vector{{1.0, kNaN, 0}}};
              }),
              ElementsAre("selector.C: 2x2; must be k x n, k >= 1, n = 3 (from M)",
                          "selector.b: 3 components; must be one per row of C: 2",
                          "selector.b[1]: nan; every entry must be finite"));
}

TEST(ProblemTest, RefusesAnEmptySystem) {
  Problem empty;
  empty.horizon = 1;
  EXPECT_THAT(Complaints(empty), ElementsAre("A: 0 rows; must be m x m for m states with at least one row",
                                             "M: 0 rows; must be n x n for n complementary pairs with at least one row",
                                             "f: no pieces; a time function has at least one",
                                             "g: no pieces; a time function has at least one"));
}

TEST(ProblemTest, NamesEveryEntryThatIsNotFinite) {
  EXPECT_THAT(ComplaintsAfter([](Problem& p) {
                p.A(1, 0) = kInfinity;
                p.B(0, 2) = kNaN;
                p.N(2, 1) = -kInfinity;
                p.M(0, 2) = kNaN;
                p.x0(1) = kNaN;
              }),
              ElementsAre("A[1][0]: inf; every entry must be finite", "B[0][2]: nan; every entry must be finite",
                          "N[2][1]: -inf; every entry must be finite", "M[0][2]: nan; every entry must be finite",
                          "x0[1]: nan; every entry must be finite"));
}

TEST(ProblemTest, AsksForAPositiveHorizon) {
  for (const double horizon : {0.0, -1.0, kNaN, kInfinity}) {
    EXPECT_THAT(ComplaintsAfter([&](Problem& p) { p.horizon = horizon; }), SizeIs(1)) << horizon;
  }
  EXPECT_THAT(ComplaintsAfter([](Problem& p) { p.horizon = -1; }),
              ElementsAre("T: -1; must be finite and greater than 0"));
}

TEST(ProblemTest, AsksForOrderedBreakPointsInsideTheHorizon) {
  EXPECT_THAT(ComplaintsAfter([](Problem& p) {
                p.break_points = {0, 1, 0.5, kNaN, 4};
              }),
              ElementsAre("break_points[2]: 0.5; must be greater than the time before it, 1",
                          "break_points[3]: nan; every time must be finite",
                          "break_points[0]: 0; must lie inside (0, T) = (0, 4)",
                          "break_points[4]: 4; must lie inside (0, T) = (0, 4)"));
}

TEST(ProblemTest, NamesTheFirstTimeWhereAFormulaHasNoFiniteValue) {
  EXPECT_THAT(ComplaintsAfter([](Problem& p) {
                p.f = TimeFunction::Formulas({"1/(t - 3)", "sqrt(2 - t)"});
                p.g = TimeFunction::Formulas({"log(t)", "t", "1/0"});
              }),
              ElementsAre("f[0]: \"1/(t - 3)\" has no finite value at t = 3: it is unbounded there",
                          "f[1]: \"sqrt(2 - t)\" has no finite value at t = 2.0000000000000004 (nan), nor after it",
                          "g[0]: \"log(t)\" has no finite value at t = 0: it is unbounded there",
                          "g[2]: \"1/0\" has no finite value (inf)"));
}

TEST(ProblemTest, AbbreviatesLongFormulasInMessages) {
  std::string sum = "log(t)";
  for (int i = 0; i < 1000; ++i) sum += " + t";
  EXPECT_THAT(
      ComplaintsAfter([&](Problem& p) {
        p.f = TimeFunction::Formulas({"0", sum});
      }),
      ElementsAre("f[1]: \"" + sum.substr(0, 80) + "...\" has no finite value at t = 0: it is unbounded there"));
}

// 0.3 is not among the 257 even times.
TEST(ProblemTest, FindsPolesWhereverTheyAre) {
  const double time = 0.3;
  EXPECT_THAT(ComplaintsAfter([&](Problem& p) {
                p.f = TimeFunction::Formulas({"1/(t - 0.3)", "0"});
              }),
              ElementsAre("f[0]: \"1/(t - 0.3)\" has no finite value at t = 0.3: it is unbounded there"));
  EXPECT_THAT(ComplaintsAfter([&](Problem& p) {
                p.f = TimeFunction::Formulas({"1/(t - 4.3)", "0"});  // T is 4
              }),
              IsEmpty());
  TimeFunction left = TimeFunction::Formulas({"1/(t - 0.3)", "0"});
  left.pieces.push_back({time, ConstantFunction{Vector::Zero(2)}});
  EXPECT_THAT(ComplaintsAfter([&](Problem& p) { p.f = left; }),
              ElementsAre("f.pieces[0][0]: \"1/(t - 0.3)\" has no finite value at t = 0.3: it is unbounded there"));
  TimeFunction right = TimeFunction::Zero(2);
  right.pieces.push_back({time, FormulaFunction{{"0", "log(t - 0.3)"}}});
  EXPECT_THAT(ComplaintsAfter([&](Problem& p) { p.f = right; }),
              ElementsAre("f.pieces[1][1]: \"log(t - 0.3)\" has no finite value at t = 0.3: it is unbounded there"));
}

TEST(ProblemTest, FindsPolynomialsThatOverflow) {
  Matrix steep(2, 3);
  steep << 0, 0, 1e308, 0, 0, 0;
  EXPECT_THAT(ComplaintsAfter([&](Problem& p) {
                p.f.pieces = {{0, PiecewisePolynomial{{0, 4}, {steep}}}};
              }),
              ElementsAre("f[0]: no finite value at t = 1.34375 (inf)"));
}

TEST(ProblemTest, GivesNoValueComplaintsWhereTheFormulaDoesNotParse) {
  EXPECT_THAT(ComplaintsAfter([](Problem& p) {
                p.f = TimeFunction::Formulas({"sin()", "log(t)"});
              }),
              ElementsAre("f[0]: at position 5: the function 'sin' needs an argument"));
}

TEST(ProblemTest, BoundsTheListAndCountsTheRest) {
  const std::vector<std::string> complaints = ComplaintsAfter([](Problem& p) {
    p.M = Matrix::Constant(30, 30, kNaN);
    p.x0(0) = kNaN;
  });
  ASSERT_THAT(complaints, SizeIs(201));
  EXPECT_THAT(complaints, Contains("M[5][10]: nan; every entry must be finite"));
  // B, N and 900 entries of M, g, x0: 200 are listed.
  EXPECT_EQ(complaints[200], "M[6][18]: here and after it 704 more rules are broken");
}

TEST(ProblemTest, CollectsBreakPointsOfBothFunctionsAndItsOwn) {
  Problem problem = SoundProblem();
  problem.break_points = {1.5, 2};
  problem.f.pieces.push_back({2, ConstantFunction{Vector::Zero(2)}});
  problem.f.pieces.push_back({9, ConstantFunction{Vector::Zero(2)}});
  problem.g.pieces.push_back({0.5, ConstantFunction{Vector::Zero(3)}});
  problem.g.pieces.push_back({3, ConstantFunction{Vector::Zero(3)}});
  EXPECT_THAT(Complaints(problem), IsEmpty());
  EXPECT_THAT(BreakPoints(problem), ElementsAre(0.5, 1.5, 2, 3));
}

}  // namespace
}  // namespace dlcs
