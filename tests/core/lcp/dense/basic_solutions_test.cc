// SPDX-License-Identifier: Apache-2.0
// All solutions of small problems: the printed sets of [Chen & Xiang 2013], and random ones by the grid.
#include "core/lcp/dense/basic_solutions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/lcp/lcp.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;
using ::testing::SizeIs;

bool Lists(const BasicSolutions& all, const Vector& y) {
  return std::any_of(all.solutions.begin(), all.solutions.end(),
                     [&](const BasicSolution& s) { return (s.y - y).lpNorm<Eigen::Infinity>() < 1e-12; });
}

// Exactly the solutions `expected`, duplicates among them allowed.
void ExpectSet(const Matrix& M, const Vector& q, const std::vector<Vector>& expected) {
  const BasicSolutions all = AllBasicSolutions(M, q);
  EXPECT_TRUE(all.complete);
  EXPECT_THAT(all.faces, SizeIs(0)) << "M is nondegenerate";
  for (const Vector& y : expected) EXPECT_TRUE(Lists(all, y)) << y.transpose() << " at q = " << q.transpose();
  for (const BasicSolution& s : all.solutions) {
    EXPECT_TRUE(
        std::any_of(expected.begin(), expected.end(), [&](const Vector& y) { return (y - s.y).norm() < 1e-12; }))
        << s.y.transpose() << " at q = " << q.transpose();
  }
}

// Example 2.1, the first matrix, as printed. (The text calls it PN; det M = -1 < 0 asks for M_22 > 0 there.)
TEST(ChenXiangExample21Test, HasThePrintedSolutionsForTheFirstMatrix) {
  const Matrix M{{1, 1}, {0, -1}};
  LcpGenerator generator(1);
  for (int round = 0; round < 200; ++round) {
    const double q1 = generator.Uniform(-3, 3), q2 = generator.Uniform(-3, 3);
    const Vector q{{q1, q2}};
    if (q2 < 0) {
      ExpectSet(M, q, {});
    } else if (q1 >= 0) {
      ExpectSet(M, q, {Vector{{0.0, 0}}, Vector{{0.0, q2}}});
    } else {
      ExpectSet(M, q, {Vector{{-q1, 0}}, Vector{{std::max(-q1 - q2, 0.0), q2}}});
    }
  }
  ExpectSet(M, Vector{{0.0, 0}}, {Vector{{0.0, 0}}});
  ExpectSet(M, Vector{{-2.0, 0}}, {Vector{{2.0, 0}}});
}

// "Similar arguments" for the other two, written out.
TEST(ChenXiangExample21Test, HasTheSolutionsOfTheOtherTwoMatrices) {
  const Matrix N{{-1, 1}, {0, 1}}, NP{{-1, 1}, {0, -1}};
  LcpGenerator generator(2);
  for (int round = 0; round < 200; ++round) {
    const double q1 = generator.Uniform(-3, 3), q2 = generator.Uniform(-3, 3);
    const Vector q{{q1, q2}};
    // w2 = q2 + y2 fixes y2 = max(-q2, 0); then y1 is 0 or q1 + y2, where that is >= 0.
    const double y2 = std::max(-q2, 0.0), rest = q1 + y2;
    std::vector<Vector> expected;
    if (rest >= 0) expected = {Vector{{0.0, y2}}, Vector{{rest, y2}}};
    ExpectSet(N, q, expected);
    // w2 = q2 - y2: y2 is 0 or q2, where q2 >= 0; then y1 as before.
    expected.clear();
    for (const double second : {0.0, q2}) {
      if (q2 >= 0 && q1 + second >= 0) {
        expected.push_back(Vector{{0.0, second}});
        expected.push_back(Vector{{q1 + second, second}});
      }
    }
    ExpectSet(NP, q, expected);
  }
}

// Example 4.1 with x = (1, 1), q = N x: the print also lists y = (1, 1, 0, 0) and y = (1, 0, 1, 0), which are none.
TEST(ChenXiangExample41Test, HasFewerSolutionsThanPrinted) {
  const Matrix M = testing::ChenXiangExample41();
  const Vector q{{-1.0, 1, 1, 1}};
  const BasicSolutions all = AllBasicSolutions(M, q);
  EXPECT_TRUE(all.complete);
  EXPECT_THAT(all.solutions, SizeIs(2));
  EXPECT_THAT(all.faces, SizeIs(0));
  EXPECT_TRUE(Lists(all, Vector{{1.0, 0, 0, 0}}));
  EXPECT_TRUE(Lists(all, Vector{{1.0, 1, 1, 0}}));
  for (const Vector& printed : {Vector{{1.0, 1, 0, 0}}, Vector{{1.0, 0, 1, 0}}}) {
    EXPECT_FALSE(Lists(all, printed));
    EXPECT_EQ(printed.dot(q + M * printed), 1);
    EXPECT_EQ(LcpResidual(M, q, printed), 1);
  }
  // The least element, as printed, lies below the other.
  EXPECT_EQ(SolveLcp(M, q, SolutionRule::kLeastElement)->y, (Vector{{1.0, 0, 0, 0}}));
}

TEST(BasicSolutionsTest, ListsEachOnceHoweverManyBasesItHas) {
  const BasicSolutions all = AllBasicSolutions(Matrix::Identity(4, 4), Vector::Zero(4));
  ASSERT_THAT(all.solutions, SizeIs(1));
  EXPECT_EQ(all.solutions[0].num_bases, 16);
  EXPECT_TRUE(all.unique());
}

TEST(BasicSolutionsTest, KeepsTheContinuumOfASingularBasis) {
  // y_1 + y_2 = 1 in every solution: the segment, with its two basic ends.
  const BasicSolutions segment = AllBasicSolutions(Matrix::Ones(2, 2), Vector{{-1.0, -1}});
  EXPECT_THAT(segment.solutions, SizeIs(2));
  ASSERT_THAT(segment.faces, SizeIs(1));
  EXPECT_FALSE(segment.faces[0].point);
  EXPECT_LE((segment.faces[0].nearest - Vector{{0.5, 0.5}}).norm(), 1e-12);
  EXPECT_FALSE(segment.unique());
  // Solutions, although no complementary basis has one: (0, y2 >= 1) and (y1, 1).
  const BasicSolutions rays = AllBasicSolutions(Matrix{{0, 1}, {0, 0}}, Vector{{-1.0, 0}});
  EXPECT_THAT(rays.solutions, SizeIs(0));
  EXPECT_THAT(rays.faces, SizeIs(2));
  EXPECT_TRUE(rays.complete);
}

TEST(BasicSolutionsTest, FindsNothingWhereThereIsNothing) {
  const BasicSolutions none = AllBasicSolutions(Matrix{{0, 1}, {-1, 0}}, Vector{{-1.0, -1}});
  EXPECT_TRUE(none.empty());
  EXPECT_TRUE(none.complete);
}

TEST(BasicSolutionsTest, FindsTheSolutionThatAProblemWasMadeOf) {
  LcpGenerator generator(3);
  for (int round = 0; round < 300; ++round) {
    const Index n = generator.Integer(1, 7);
    const Matrix M = generator.Gaussian(n, n);
    Vector y;
    const Vector q = generator.SolvableQ(M, false, &y);
    const BasicSolutions all = AllBasicSolutions(M, q);
    EXPECT_TRUE(std::any_of(all.solutions.begin(), all.solutions.end(),
                            [&](const BasicSolution& s) { return (s.y - y).norm() < 1e-7 * (1 + y.norm()); }));
    for (const BasicSolution& s : all.solutions) {
      EXPECT_LE(LcpResidual(M, q, s.y), 1e-10 * (1 + q.norm() + M.norm() * s.y.norm()));
      EXPECT_FALSE(s.sets.degenerate());
    }
  }
}

TEST(BasicSolutionsTest, ListsNoSolutionBeyondTheRangeOfDoubles) {
  const BasicSolutions all = AllBasicSolutions(Matrix{{1e-320}}, Vector{{-1.0}});  // y = 1e320
  EXPECT_TRUE(all.solutions.empty());
  EXPECT_FALSE(all.complete);
}

TEST(BasicSolutionsTest, FindsOneForAPMatrixAndStopsWhenTold) {
  LcpGenerator generator(4);
  for (int round = 0; round < 50; ++round) {
    const Index n = generator.Integer(1, 8);
    EXPECT_TRUE(AllBasicSolutions(generator.IndefinitePMatrix(n), generator.GaussianVector(n)).unique());
  }
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(AllBasicSolutions(Matrix::Identity(16, 16), Vector::Ones(16), stop.get_token()).complete);
}

}  // namespace
}  // namespace dlcs
