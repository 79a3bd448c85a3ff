// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/semicopositive.h"

#include <gtest/gtest.h>

#include "core/matrix_classes/copositive.h"
#include "core/matrix_classes/semicopositive_types.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

void ExpectRefuted(const Matrix& M, const Fact& fact) {
  ASSERT_TRUE(fact.no()) << fact.why;
  const auto& [indices, value, z, X, Y, r, s] = fact.witness;
  ASSERT_EQ(z.size(), static_cast<Index>(indices.size()));
  EXPECT_GE(z.minCoeff(), 0);
  EXPECT_GT(z.maxCoeff(), 0);
  EXPECT_LE((M(indices, indices) * z).maxCoeff(), 0);
}

TEST(SemicopositiveTest, KnowsExample10AsTypeI) {
  const Matrix R{{1, 3, 0}, {0, 1, 3}, {3, 0, 1}};
  EXPECT_TRUE(TestStrictlySemicopositive(R).yes());
  EXPECT_TRUE(TestSemicopositiveTypeI(R).yes());
}

// Proposition 4: [1 a; b 1] is strictly semicopositive unless a < 0, b < 0 and ab >= 1.
TEST(SemicopositiveTest, DecidesTheTwoFormsOfProposition4) {
  for (const double a : {-3.0, -1.5, -0.5, 0.0, 0.5, 3.0}) {
    for (const double b : {-3.0, -1.5, -0.5, 0.0, 0.5, 3.0}) {
      const Matrix M{{1, a}, {b, 1}};
      if (a < 0 && b < 0 && a * b >= 1) {
        ExpectRefuted(M, TestStrictlySemicopositive(M));
        ExpectRefuted(M, TestSemicopositiveTypeI(M));
      } else {
        EXPECT_TRUE(TestStrictlySemicopositive(M).yes()) << M;
        EXPECT_TRUE(TestSemicopositiveTypeI(M).yes()) << M;
      }
    }
  }
}

// 2⁻²⁸ above and 1e-9 below the singular [1 -1; -1 1], and that matrix itself.
TEST(SemicopositiveTest, DecidesNextToTheBoundaryWhereEntriesAreShort) {
  constexpr double kUnit = 0x1p-28;
  EXPECT_TRUE(TestStrictlySemicopositive(Matrix{{1, -1}, {-1, 1 + kUnit}}).yes());
  const Matrix singular{{1, -1}, {-1, 1}};
  ExpectRefuted(singular, TestStrictlySemicopositive(singular));
  EXPECT_TRUE(ClassifySemicopositive(singular).weak.yes());
  const Matrix below{{1, -1}, {-1, 1 - 1e-9}};
  ExpectRefuted(below, TestStrictlySemicopositive(below));
  EXPECT_TRUE(ClassifySemicopositive(below).weak.no());
}

// A Z-matrix is strictly semicopositive exactly when it is a nonsingular M-matrix.
TEST(SemicopositiveTest, AgreesWithMMatricesAndRefutesOtherZMatrices) {
  LcpGenerator generator(1);
  for (int k = 0; k < 60; ++k) {
    const Index n = generator.Integer(2, 6);
    EXPECT_TRUE(TestStrictlySemicopositive(generator.MMatrix(n)).yes());
    const Matrix M = Matrix::Constant(n, n, -1) + (n - generator.Uniform(0.1, 0.9)) * Matrix::Identity(n, n);
    ExpectRefuted(M, TestStrictlySemicopositive(M));  // (M 1)_i < 0
  }
}

TEST(CopositiveTest, NamesTheEntryOfTheMatrixItselfAndOtherwiseItsSymmetricPart) {
  const CopositiveClasses negative = ClassifyCopositive(Matrix{{1, 4}, {3, -1.5}});
  EXPECT_EQ(negative.strictly_copositive.why, "M[1][1] = -1.5 is negative");
  EXPECT_EQ(negative.copositive.why, "M[1][1] = -1.5 is negative");
  EXPECT_EQ(ClassifyCopositive(Matrix{{1, 4}, {3, 0}}).strictly_copositive.why, "M[1][1] = 0 is not positive");
  for (const Matrix& M : {Matrix{{1, 4}, {3, 2}}, Matrix{{1, -4}, {1, 1}}, Matrix{{1, -1}, {0.5, 1}}}) {
    EXPECT_EQ(ClassifyCopositive(M).copositive.why.rfind("of its symmetric part (doubled): ", 0), 0) << M;
  }
}

// Beyond n = 20 sufficient tests and one linear program are left.
TEST(SemicopositiveTest, AnswersBeyondTheExactSize) {
  LcpGenerator generator(2);
  const Index n = 30;
  const SemicopositiveClasses m_matrix = ClassifySemicopositive(generator.MMatrix(n));
  EXPECT_TRUE(m_matrix.strict.yes() && m_matrix.weak.yes());
  Matrix mixed = Matrix::Constant(n, n, 5) + Matrix::Identity(n, n);
  mixed(0, 1) = -20;  // outweighed by nothing in its row, but by no other negative entry either
  EXPECT_TRUE(ClassifySemicopositive(mixed).strict.yes());
  EXPECT_TRUE(TestSemicopositiveTypeI(Matrix(mixed.cwiseAbs())).yes());
  const Matrix negative = Matrix::Constant(n, n, -1) + Matrix(2 * Matrix::Identity(n, n));
  const SemicopositiveClasses refuted = ClassifySemicopositive(negative);
  ExpectRefuted(negative, refuted.strict);
  ASSERT_TRUE(refuted.weak.no());
  EXPECT_GT(refuted.weak.witness.z.minCoeff(), 0);
  EXPECT_LT((negative * refuted.weak.witness.z).maxCoeff(), 0);
  const CopositiveClasses forms = ClassifyCopositive(negative);
  EXPECT_TRUE(forms.strictly_copositive.no() && forms.copositive.no());
  EXPECT_LT(*forms.copositive.witness.value, 0);
}

}  // namespace
}  // namespace dlcs
