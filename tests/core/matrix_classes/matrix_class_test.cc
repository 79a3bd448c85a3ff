// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/matrix_class.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <string>
#include <vector>

#include "core/matrix_classes/p_matrix.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using testing::LcpGenerator;

// The least principal minor by brute force, relative to the size of its terms.
double LeastPrincipalMinor(const Matrix& M) {
  double least = std::numeric_limits<double>::infinity();
  for (unsigned subset = 1; subset < (1u << M.rows()); ++subset) {
    std::vector<Index> indices;
    for (Index i = 0; i < M.rows(); ++i) {
      if (subset >> i & 1u) indices.push_back(i);
    }
    least = std::min(least, Matrix(M(indices, indices)).determinant());
  }
  return least;
}

TEST(MatrixClassTest, DescribesTheClassesOfTheCases) {
  EXPECT_EQ(Classify(Matrix{{2, -1}, {-1, 2}}).description, "P- and Z-matrix (nonsingular M-matrix)");
  EXPECT_THAT(Classify(Matrix{{2, 1}, {-5, 2}}).description, HasSubstr("P-matrix"));
  EXPECT_THAT(Classify(Matrix{{1, -2}, {-2, 1}}).description,
              HasSubstr("Z-matrix, not a P-matrix (the principal minor of rows {0, 1} is -3)"));
  EXPECT_THAT(Classify(Matrix::Zero(3, 3)).description, HasSubstr("zero"));
  EXPECT_THAT(Classify(Matrix{{0, 1}, {-1, 0}}).description, HasSubstr("skew"));
  // The diode bridge: nonsingular, symmetric part of rank one.
  const Matrix bridge{{0.001, 0.001, -1, 0}, {0.001, 0.001, 0, -1}, {1, 0, 0, 0}, {0, 1, 0, 0}};
  EXPECT_TRUE(Classify(bridge).positive_semidefinite.yes());
  EXPECT_EQ(Classify(bridge).p.answer, Answer::kNo);
  EXPECT_THAT(Classify(Matrix{{1, 2}, {3, 1}}).description, HasSubstr("neither"));
}

TEST(MatrixClassTest, SelectsTheRuleOfTheMatrix) {
  const auto select = [](const Matrix& M, SolutionRule rule) { return SelectRule(rule, Classify(M)); };
  EXPECT_EQ(*select(Matrix::Identity(2, 2), SolutionRule::kAuto), Selection::kUnique);
  EXPECT_EQ(*select(testing::ChenXiangExample41(), SolutionRule::kAuto), Selection::kLeastElement);
  EXPECT_EQ(*select(testing::WuChenExample42(), SolutionRule::kAuto), Selection::kLeastElement);
  EXPECT_EQ(*select(Matrix{{0, 1}, {-1, 0}}, SolutionRule::kAuto), Selection::kAny);
  EXPECT_EQ(*select(Matrix::Identity(2, 2), SolutionRule::kLeastElement), Selection::kLeastElement);
  EXPECT_THAT(std::string(select(testing::ChenXiangExample41(), SolutionRule::kUnique).status().message()),
              HasSubstr("M[1][1] = 0"));
}

// A constraint on the state alone has a multiplier, which the least element would set to zero.
TEST(MatrixClassTest, TakesNoLeastElementByItselfWhereARowIsZero) {
  EXPECT_EQ(*SelectRule(SolutionRule::kAuto, Classify(Matrix::Zero(2, 2))), Selection::kAny);
  EXPECT_EQ(*SelectRule(SolutionRule::kAuto, Classify(Matrix{{1, -1}, {0, 0}})), Selection::kAny);
  EXPECT_EQ(*SelectRule(SolutionRule::kLeastElement, Classify(Matrix::Zero(2, 2))), Selection::kLeastElement);
}

TEST(MatrixClassTest, FindsEveryPMatrixUpToTheExactSize) {
  LcpGenerator generator(1);
  int yes = 0;
  int no = 0;
  for (int k = 0; k < 400; ++k) {
    const Index n = generator.Integer(1, 8);
    Matrix M = k % 4 == 0 ? generator.IndefinitePMatrix(n) : generator.Gaussian(n, n);
    if (k % 4 == 1) M.diagonal() = M.diagonal().cwiseAbs().array() + 1;
    if (k % 4 == 2) M = generator.PositiveDefinite(n) + 0.5 * generator.Skew(n);
    const double least = LeastPrincipalMinor(M);
    if (std::abs(least) < 1e-8) continue;
    const Fact p = TestPMatrix(generator.BadlyScaled(M, k % 3 == 0 ? 4 : 0));
    EXPECT_EQ(p.answer, least > 0 ? Answer::kYes : Answer::kNo) << M << "\n" << p.why;
    ++(least > 0 ? yes : no);
  }
  EXPECT_GT(yes, 100);
  EXPECT_GT(no, 100);
}

TEST(MatrixClassTest, ProvesPBeyondTheEigenvaluesUpToTwenty) {
  LcpGenerator generator(2);
  const Matrix M = generator.IndefinitePMatrix(20);
  EXPECT_EQ(Classify(M).positive_semidefinite.answer, Answer::kNo);
  EXPECT_EQ(TestPMatrix(M).why, "all principal minors are positive");
}

TEST(MatrixClassTest, CallsAMinorZeroThatIsZeroToRounding) {
  // det = 0 in exact arithmetic; 0.1 · 0.3 and 0.01 · 3 differ in the last bit of a double.
  EXPECT_EQ(TestPMatrix(Matrix{{0.1, 0.01}, {3, 0.3}}).answer, Answer::kNo);
  EXPECT_EQ(TestPMatrix(Matrix{{1, 1}, {1, 1 + 1e-12}}).answer, Answer::kYes);
  LcpGenerator generator(3);
  for (const Index n : {3, 5, 10, 15, 40, 150}) {
    EXPECT_EQ(TestPMatrix(generator.SingularMMatrix(n)).answer, Answer::kNo) << n;
    EXPECT_EQ(TestPMatrix(generator.BadlyScaled(generator.SingularMMatrix(n), 3)).answer, Answer::kNo) << n;
  }
}

TEST(MatrixClassTest, DecidesLargeMatricesByPolynomialTests) {
  LcpGenerator generator(4);
  for (const Index n : {30, 120}) {
    EXPECT_TRUE(TestPMatrix(generator.MMatrix(n)).yes());
    EXPECT_TRUE(TestPMatrix(generator.BadlyScaled(generator.MMatrix(n), 5)).yes());
    EXPECT_TRUE(TestPMatrix(generator.PositiveDefinite(n)).yes());
    EXPECT_EQ(TestPMatrix(generator.ZMatrix(n)).answer, Answer::kNo);
    Matrix signs = generator.MMatrix(n);  // an H-matrix: signs of off-diagonal entries do not matter
    for (Index j = 0; j < n; ++j) {
      for (Index i = 0; i < n; ++i) {
        if (i != j && generator.Uniform(0, 1) < 0.5) signs(i, j) = -signs(i, j);
      }
    }
    EXPECT_THAT(TestPMatrix(signs).why, HasSubstr("H-matrix"));
    // Not P by a leading minor of a reordering only, or unknown; never yes.
    EXPECT_FALSE(TestPMatrix(generator.Gaussian(n, n) + 2 * Matrix::Identity(n, n)).yes());
  }
  const Fact unknown = TestPMatrix(generator.IndefinitePMatrix(30));
  EXPECT_EQ(unknown.answer, Answer::kUnknown) << unknown.why;
  EXPECT_THAT(unknown.why, HasSubstr("n = 30"));
}

TEST(MatrixClassTest, JudgesTheQuadraticFormWithExactZeros) {
  LcpGenerator generator(5);
  const auto semidefinite = [](const Matrix& M) { return Classify(M).positive_semidefinite.answer; };
  EXPECT_EQ(semidefinite(generator.Skew(9)), Answer::kYes);
  EXPECT_EQ(semidefinite(generator.BadlyScaled(generator.Skew(9), 6)), Answer::kYes);
  EXPECT_EQ(semidefinite(generator.PositiveSemidefinite(10, 3)), Answer::kYes);
  EXPECT_EQ(semidefinite(generator.BadlyScaled(generator.PositiveSemidefinite(10, 3), 6)), Answer::kYes);
  EXPECT_EQ(semidefinite(generator.PositiveSemidefinite(10, 3) - 1e-8 * Matrix::Identity(10, 10)), Answer::kNo);
  EXPECT_EQ(semidefinite(Matrix{{0, 1e-9}, {0, 1}}), Answer::kNo);  // a zero diagonal needs a zero row
  EXPECT_EQ(semidefinite(Matrix{{1e-20, 0}, {0, 1}}), Answer::kYes);
  EXPECT_EQ(semidefinite(Matrix{{-1e-20, 0}, {0, 1}}), Answer::kNo);
}

TEST(MatrixClassTest, ComputesTheLipschitzConstantOfTheLcp) {
  EXPECT_DOUBLE_EQ(*Classify(testing::ChenXiangExample41()).lipschitz, 1);
  EXPECT_DOUBLE_EQ(*Classify(Matrix{{0, 0}, {-1e-3, 0}}).lipschitz,
                   0);  // Remark 2.2: no nonsingular submatrix
  EXPECT_NEAR(*Classify(testing::WuChenExample42()).lipschitz, 30, 0.5);
  EXPECT_FALSE(Classify(Matrix{{0, 1}, {-1, 0}}).lipschitz.has_value());
  // M-matrices of any size: ‖M⁻¹‖, here of tridiag(-1, 4, -1) below 1/(4 - 2).
  LcpGenerator generator(6);
  for (const Index n : {5, 12, 13, 60}) {
    const Matrix M = generator.MMatrix(n);
    EXPECT_NEAR(*Classify(M).lipschitz / M.inverse().cwiseAbs().rowwise().sum().maxCoeff(), 1, 1e-10);
  }
  // Beyond n = 12 a bound: never below what a few submatrices show.
  const Matrix M = generator.PositiveDefinite(14);
  const double bound = *Classify(M).lipschitz;
  for (Index k = 1; k <= 14; ++k) {
    EXPECT_GE(bound, M.topLeftCorner(k, k).inverse().cwiseAbs().rowwise().sum().maxCoeff());
  }
}

}  // namespace
}  // namespace dlcs
