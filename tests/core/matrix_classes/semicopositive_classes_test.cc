// SPDX-License-Identifier: Apache-2.0
// Semicopositive and copositive matrices judged by integers.
#include <gtest/gtest.h>

#include <cmath>

#include "core/matrix_classes/class_profile.h"
#include "core/matrix_classes/copositive.h"
#include "core/matrix_classes/semicopositive.h"
#include "core/matrix_classes/semicopositive_types.h"
#include "tests/support/fact_judge.h"
#include "tests/support/integer_matrices.h"

namespace dlcs {
namespace {

using testing::AsDoubles;
using testing::CopositiveTruth;
using testing::ExactlyCopositive;
using testing::ExactlySemicopositive;
using testing::ExactlyStrictlySemicopositive;
using testing::IntegerMatrix;
using testing::Judge;
using Generator = testing::IntegerMatrixGenerator;
using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

// M_SS and z of the witness, in long double.
struct Claim {
  Claim(const Matrix& M, const Fact& fact)
      : block(Matrix(M(fact.witness.indices, fact.witness.indices)).cast<long double>()),
        z(fact.witness.z.cast<long double>()) {}
  Long block, z;
};

void ExpectProven(const Matrix& M, const SemicopositiveClasses& known) {
  if (known.strict.no()) {
    const Claim claim(M, known.strict);
    EXPECT_GE(claim.z.minCoeff(), 0);
    EXPECT_GT(claim.z.maxCoeff(), 0);
    EXPECT_LE((claim.block * claim.z).maxCoeff(), 0) << M;
  }
  if (known.weak.no()) {
    const Claim claim(M, known.weak);
    EXPECT_GT(claim.z.minCoeff(), 0);
    EXPECT_LT((claim.block * claim.z).maxCoeff(), 0) << M;
  }
  if (known.strict.yes() && known.strict.witness.z.size() > 0) {  // Ñz > 0
    const Vector& z = known.strict.witness.z;
    Matrix negative = M.cwiseMin(0);
    negative.diagonal() = M.diagonal();
    EXPECT_GT(z.minCoeff(), 0);
    EXPECT_GT((negative * z).minCoeff(), 0) << M;
  }
}

void ExpectProven(const Matrix& M, const CopositiveClasses& known) {
  for (const Fact* fact : {&known.strictly_copositive, &known.copositive}) {
    if (!fact->no()) continue;
    const Claim claim(M, *fact);
    const long double form = (claim.z.transpose() * claim.block * claim.z)(0, 0);
    EXPECT_GE(claim.z.minCoeff(), 0);
    EXPECT_GT(claim.z.maxCoeff(), 0);
    EXPECT_LE(form, 0) << M;
    if (fact == &known.copositive) {
      EXPECT_LT(form, 0) << M;
    }
    EXPECT_NEAR(*fact->witness.value, static_cast<double>(form), 1e-12 * std::abs(*fact->witness.value));
  }
}

TEST(SemicopositiveClassesTest, AgreeWithIntegersOnTenThousandMatrices) {
  Generator generator(1993);
  Judge strict, weak, strictly_copositive, copositive, types;
  for (int k = 0; k < 10000; ++k) {
    const Index n = k % 100 == 0 ? generator.Integer(5, 7) : generator.Integer(1, 4);
    const IntegerMatrix a = generator.Any(n);
    const Matrix M = AsDoubles(a, static_cast<int>(generator.Integer(-20, 20)));
    const SemicopositiveClasses known = ClassifySemicopositive(M);
    strict.Answers(known.strict, ExactlyStrictlySemicopositive(a), "strictly semicopositive", M);
    if (n <= 4) weak.Answers(known.weak, ExactlySemicopositive(a), "semicopositive", M);
    ExpectProven(M, known);
    const Fact type_one = TestSemicopositiveTypeI(M, known.strict);
    EXPECT_TRUE(known.strict.yes() || !type_one.yes()) << M;
    EXPECT_TRUE(!known.strict.no() || type_one.no()) << M;
    types.Answers(type_one, type_one.yes(), "type I", M);
    const CopositiveClasses forms = ClassifyCopositive(M);
    const CopositiveTruth truth = ExactlyCopositive(a);
    strictly_copositive.Answers(forms.strictly_copositive, truth.strictly_copositive, "strictly copositive", M);
    copositive.Answers(forms.copositive, truth.copositive, "copositive", M);
    ExpectProven(M, forms);
  }
  for (const Judge* judge : {&strict, &weak, &strictly_copositive, &copositive}) {
    EXPECT_GT(judge->yes(), 1000);
    EXPECT_GT(judge->no(), 1000);
    EXPECT_EQ(judge->share_of_unknown(), 0);  // the entries are short, so that zeros are known exactly
  }
  EXPECT_LT(types.share_of_unknown(), 0.05);
}

// A singular integer matrix moved by 2⁻²⁰ … 2⁻³⁸: closer to the boundary than rounding can see.
TEST(SemicopositiveClassesTest, AreNeverWrongNextToTheBoundary) {
  Generator generator(11);
  Judge strict, weak, strictly_copositive, copositive;
  for (int k = 0; k < 2000; ++k) {
    const Index n = generator.Integer(2, 3);
    const int shift = static_cast<int>(generator.Integer(20, 38));
    IntegerMatrix a = generator.Any(n);
    for (auto& row : a) {
      for (auto& entry : row) entry *= std::int64_t{1} << shift;
    }
    a.back() = a.front();
    for (std::size_t i = 0; i < a.size(); ++i) a.back()[i] = -a.back()[i] + generator.Integer(-3, 3);
    for (std::size_t i = 0; i < a.size(); ++i) a[i].back() = a.back()[i];
    a.back().back() = a.front().front() + generator.Integer(-3, 3);
    const Matrix M = AsDoubles(a, -shift);
    const SemicopositiveClasses known = ClassifySemicopositive(M);
    strict.Answers(known.strict, ExactlyStrictlySemicopositive(a), "strictly semicopositive", M);
    weak.Answers(known.weak, ExactlySemicopositive(a), "semicopositive", M);
    const CopositiveClasses forms = ClassifyCopositive(M);
    const CopositiveTruth truth = ExactlyCopositive(a);
    strictly_copositive.Answers(forms.strictly_copositive, truth.strictly_copositive, "strictly copositive", M);
    copositive.Answers(forms.copositive, truth.copositive, "copositive", M);
  }
  for (const Judge* judge : {&strict, &weak, &strictly_copositive, &copositive}) {
    EXPECT_GT(judge->yes(), 100);
    EXPECT_LT(judge->share_of_unknown(), 0.05);
  }
}

// Sums M + Mᵀ that need 54 bits: the forms are those of [1 -1; -1 1] but for one unit in the last place.
TEST(SemicopositiveClassesTest, AreNotWrongWhereSumsAreRounded) {
  constexpr double kUnit = 0x1p-53;
  const CopositiveClasses above = ClassifyCopositive(Matrix{{1, -1}, {-1 + kUnit, 1}});
  EXPECT_FALSE(above.strictly_copositive.no());
  EXPECT_FALSE(above.copositive.no());
  const CopositiveClasses below = ClassifyCopositive(Matrix{{1, -1}, {-1 - 2 * kUnit, 1}});
  EXPECT_FALSE(below.strictly_copositive.yes());
  EXPECT_FALSE(below.copositive.yes());
}

// ∫_0^t v_i' (Mv)_i dτ along the polygon of the columns of `path`.
Vector Integrals(const Matrix& M, const Matrix& path) {
  Vector integrals = Vector::Zero(M.rows());
  for (Index k = 1; k < path.cols(); ++k) {
    const Vector middle = 0.5 * (path.col(k) + path.col(k - 1));
    integrals += (path.col(k) - path.col(k - 1)).cwiseProduct(M * middle);
  }
  return integrals;
}

// Nondecreasing polygons from zero, most of them growing in one direction at a time.
Matrix MonotonePath(Generator& generator, Index n) {
  Matrix path = Matrix::Zero(n, 12);
  for (Index k = 1; k < path.cols(); ++k) {
    path.col(k) = path.col(k - 1);
    for (Index i = 0; i < n; ++i) {
      if (generator.Integer(0, n) == 0) path(i, k) += std::exp2(static_cast<double>(generator.Integer(-4, 4)));
    }
  }
  return path;
}

// Scaling by powers of two is exact, so that the truth of the symmetric matrix decides.
TEST(SemicopositiveTypesTest, KnowScaledSymmetricMatrices) {
  Generator generator(4);
  int yes = 0, no = 0;
  for (int k = 0; k < 300; ++k) {
    const Index n = generator.Integer(3, 5);
    const IntegerMatrix a = testing::DoubledSymmetricPart(generator.Any(n));
    const auto scale = [&](Index) { return std::exp2(static_cast<double>(generator.Integer(-9, 9))); };
    const Vector D = Vector::NullaryExpr(n, scale), E = Vector::NullaryExpr(n, scale);
    const Fact fact = TestSemicopositiveTypeI(D.asDiagonal() * AsDoubles(a, 0) * E.asDiagonal());
    ASSERT_NE(fact.answer, Answer::kUnknown) << fact.why;
    EXPECT_EQ(fact.yes(), ExactlyStrictlySemicopositive(a));
    ++(fact.yes() ? yes : no);
  }
  EXPECT_GT(yes, 50);
  EXPECT_GT(no, 50);
}

// With the weights of the witness, Σ f_i ∫ v_i' (Mv)_i dτ > 0 for every v; and so the largest is.
TEST(SemicopositiveTypesTest, HoldAlongMonotonePaths) {
  Generator generator(5);
  int yes = 0;
  for (int k = 0; k < 300; ++k) {
    const Index n = generator.Integer(2, 5);
    const Matrix M = AsDoubles(generator.Any(n), 0);
    const Fact fact = TestSemicopositiveTypeI(M);
    if (!fact.yes()) continue;
    ++yes;
    for (int trial = 0; trial < 50; ++trial) {
      const Matrix path = MonotonePath(generator, n);
      if (path.col(path.cols() - 1).maxCoeff() == 0) continue;
      const Vector integrals = Integrals(M, path);
      EXPECT_GT(integrals.maxCoeff(), 0) << M;
      if (fact.witness.z.size() == n) {
        EXPECT_GT(fact.witness.z.dot(integrals), 0) << M;
      }
    }
  }
  EXPECT_GT(yes, 100);
}

// Ten rounds of the witness, the first from z λ⁻¹⁰: the polygon is nondecreasing and ends in z.
Matrix GrowingPath(const Matrix& M, const Fact& fact) {
  const auto& [indices, factor, z, X, Y, place, s] = fact.witness;
  Vector v = Vector::Zero(M.rows());
  for (std::size_t k = 0; k < indices.size(); ++k) v[indices[k]] = z[static_cast<Index>(k)];
  v *= std::pow(*factor, -10);
  Matrix path(M.rows(), 1 + 10 * M.rows());
  Index column = 0;
  path.col(0) = v;
  for (int round = 0; round < 10; ++round) {
    for (Index step = 0; step < M.rows(); ++step) {
      for (std::size_t k = 0; k < indices.size(); ++k) {
        if (place[static_cast<Index>(k)] == static_cast<double>(step)) v[indices[k]] *= *factor;
      }
      path.col(++column) = v;
    }
  }
  return path;
}

// I - ρC is an M-matrix for ρ < 1. The least factor is λ^(1/n) + λ^(1/n - 1), at λ = n - 1, for 2ρ.
TEST(SemicopositiveTypesTest, RefutesTypeThreeForCyclicMMatrices) {
  for (const Index n : {3, 4, 5}) {
    const double root = std::pow(static_cast<double>(n - 1), 1.0 / static_cast<double>(n));
    const double least = 0.5 * (root + root / static_cast<double>(n - 1));
    for (const double rho : {least - 0.01, least + 0.01}) {
      Matrix M = Matrix::Identity(n, n);
      for (Index i = 0; i < n; ++i) M(i, (i + 1) % n) = -rho;
      EXPECT_TRUE(TestStrictlySemicopositive(M).yes());
      const Fact fact = TestSemicopositiveTypeI(M);
      EXPECT_EQ(fact.no(), rho > least) << "n = " << n << ": " << fact.why;
      if (!fact.no()) continue;
      const Matrix path = GrowingPath(M, fact);
      EXPECT_GE((path.rightCols(path.cols() - 1) - path.leftCols(path.cols() - 1)).minCoeff(), 0);
      EXPECT_LT(Integrals(M, path).maxCoeff(), 0) << fact.why;
    }
  }
}

// Diagonally dominant matrices with a strong cycle: along the path of a no, no integral is positive beyond
// rounding.
TEST(SemicopositiveTypesTest, RefutesByPathsOnRandomMatrices) {
  Generator generator(6);
  int refuted = 0;
  for (int k = 0; k < 100; ++k) {
    const Index n = generator.Integer(3, 5);
    Matrix M = Matrix::NullaryExpr(n, n, [&](Index, Index) { return static_cast<double>(generator.Integer(-1, 3)); });
    M.diagonal().setConstant(100);
    for (Index i = 0; i < n; ++i) M(i, (i + 1) % n) = -static_cast<double>(generator.Integer(80, 96));
    const Fact fact = TestSemicopositiveTypeI(M);
    EXPECT_TRUE(TestStrictlySemicopositive(M).yes());
    if (!fact.no()) continue;
    ++refuted;
    EXPECT_LE(Integrals(M, GrowingPath(M, fact)).maxCoeff(), 1e-12 * M.norm() * fact.witness.z.squaredNorm()) << M;
  }
  EXPECT_GT(refuted, 20);
}

}  // namespace
}  // namespace dlcs
