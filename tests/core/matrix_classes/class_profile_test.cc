// SPDX-License-Identifier: Apache-2.0
// Classes judged by integers: every answer on 10,000 matrices against determinants and adjugates in 128 bits.
#include "core/matrix_classes/class_profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/analysis/class_section.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/matrix_classes/s_matrix.h"
#include "tests/support/fact_judge.h"
#include "tests/support/integer_matrices.h"

namespace dlcs {
namespace {

using testing::AsDoubles;
using testing::DoubledSymmetricPart;
using testing::ExactDeterminant;
using testing::ExactMinorClasses;
using testing::IntegerMatrix;
using testing::Judge;
using testing::MinorTruth;
using Generator = testing::IntegerMatrixGenerator;

void ExpectMinorWitness(const Fact& fact, const IntegerMatrix& a, int exponent) {
  if (fact.answer == Answer::kUnknown) return;
  const auto& indices = fact.witness.indices;
  ASSERT_FALSE(indices.empty()) << fact.why;
  const double exact = std::ldexp(static_cast<double>(ExactDeterminant(a, indices, indices)),
                                  exponent * static_cast<int>(indices.size()));
  EXPECT_EQ(std::signbit(*fact.witness.value), std::signbit(exact));
  // Near a zero the value of a minor holds few digits; its sign is what was claimed.
  const double scale = AsDoubles(a, exponent)(indices, indices).colwise().norm().prod();
  EXPECT_NEAR(*fact.witness.value, exact, 1e-12 * scale) << fact.why;
}

void JudgeMinors(const IntegerMatrix& a, int exponent, Judge& judge) {
  const Matrix M = AsDoubles(a, exponent);
  const MinorClasses known = ClassifyByMinors(M);
  const MinorTruth truth = ExactMinorClasses(a);
  judge.Answers(known.nondegenerate, truth.nondegenerate, "nondegenerate", M);
  judge.Answers(known.p, truth.p, "P", M);
  judge.Answers(known.p0, truth.p0, "P0", M);
  judge.Answers(known.n, truth.n, "N", M);
  judge.Answers(known.np, truth.np, "NP", M);
  judge.Answers(known.pn, truth.pn, "PN", M);
  for (const Fact* fact : {&known.nondegenerate, &known.p, &known.p0, &known.n, &known.np, &known.pn}) {
    ExpectMinorWitness(*fact, a, exponent);
  }
}

void JudgeForm(const IntegerMatrix& a, int exponent, Judge& judge) {
  const Matrix M = AsDoubles(a, exponent);
  const QuadraticFormClasses known = ClassifyQuadraticForm(M);
  const MinorTruth truth = ExactMinorClasses(DoubledSymmetricPart(a));
  judge.Answers(known.positive_definite, truth.p, "positive definite", M);
  judge.Answers(known.positive_semidefinite, truth.p0, "positive semidefinite", M);
  const Vector& z = known.positive_semidefinite.witness.z;
  if (known.positive_semidefinite.no() && z.size() > 0) {
    EXPECT_LT(z.dot(M * z), 0);
  }
}

// Either witness is a proof; both are checked in long double.
void JudgeS(const Matrix& M) {
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const Fact s = TestSMatrix(M);
  if (s.answer == Answer::kUnknown) return;
  const Long z = s.witness.z.cast<long double>();
  EXPECT_GE(z.minCoeff(), 0);
  EXPECT_GT(z.maxCoeff(), 0);
  if (s.yes()) {
    EXPECT_GT((M.cast<long double>() * z).minCoeff(), 0) << M;
  }
  if (s.no()) {
    EXPECT_LE((M.transpose().cast<long double>() * z).maxCoeff(), 0) << M;
  }
}

TEST(ClassProfileTest, AgreesWithExactMinorsOnTenThousandMatrices) {
  Generator generator(20130521);
  Judge minors, form, m;
  for (int k = 0; k < 10000; ++k) {
    const Index n = k % 20 == 0 ? generator.Integer(6, 8) : generator.Integer(1, 5);
    const IntegerMatrix a = generator.Any(n);
    const int exponent = static_cast<int>(generator.Integer(-20, 20));
    JudgeMinors(a, exponent, minors);
    JudgeForm(a, exponent, form);
    const Matrix M = AsDoubles(a, exponent);
    const Fact z = TestZMatrix(M);
    EXPECT_EQ(z.yes(), ((M - Matrix(M.diagonal().asDiagonal())).array() <= 0).all());
    m.Answers(TestMMatrix(z, TestSMatrix(M)), z.yes() && ExactMinorClasses(a).p, "M", M);
    JudgeS(M);
  }
  EXPECT_GT(minors.yes(), 5000);
  EXPECT_GT(minors.no(), 5000);
  EXPECT_EQ(minors.share_of_unknown(), 0);  // the entries are short, so that zeros are known exactly
  EXPECT_LT(form.share_of_unknown(), 0.001);
  EXPECT_GT(form.yes(), 1000);
  EXPECT_GT(m.yes(), 300);
  EXPECT_LT(m.share_of_unknown(), 0.01);
}

// A singular integer matrix moved by 2⁻²⁰ … 2⁻⁵²: closer to the boundary than rounding can see.
TEST(ClassProfileTest, IsNeverWrongNextToTheBoundary) {
  Generator generator(7);
  Judge minors, form;
  for (int k = 0; k < 4000; ++k) {
    const Index n = generator.Integer(2, 3);
    const int shift = static_cast<int>(generator.Integer(20, n == 2 ? 52 : 38));
    IntegerMatrix a = generator.Any(n);
    for (auto& row : a) {
      for (auto& entry : row) entry = entry * (std::int64_t{1} << shift) / (n == 2 ? 256 : 1);
    }
    a.back() = a.front();
    for (auto& entry : a.back()) entry += generator.Integer(-3, 3);
    JudgeMinors(a, -shift, minors);
    if (n == 2) JudgeForm(a, -shift, form);
  }
  EXPECT_LT(minors.share_of_unknown(), 0.25);
  EXPECT_GT(minors.share_of_unknown(), 0);
}

// [Chen & Xiang] call the first a PN-, the second an N-matrix; by the definitions of section 1 neither is.
// The third is an NP-matrix, as printed.
TEST(ClassProfileTest, ReadsExample21ByThePapersOwnDefinitions) {
  const MinorClasses first = ClassifyByMinors(Matrix{{1, 1}, {0, -1}});
  EXPECT_TRUE(first.nondegenerate.yes());
  EXPECT_TRUE(first.pn.no());  // M[1][1] = -1, where order one must be positive
  EXPECT_EQ(first.pn.witness.indices, std::vector<Index>{1});
  const MinorClasses second = ClassifyByMinors(Matrix{{-1, 1}, {0, 1}});
  EXPECT_TRUE(second.nondegenerate.yes());
  EXPECT_TRUE(second.n.no());  // M[1][1] = 1, where all must be negative
  EXPECT_EQ(second.n.witness.indices, std::vector<Index>{1});
  const MinorClasses third = ClassifyByMinors(Matrix{{-1, 1}, {0, -1}});
  EXPECT_TRUE(third.nondegenerate.yes());
  EXPECT_TRUE(third.np.yes());
}

TEST(ClassProfileTest, KnowsTheMatricesOfRemark22AndExample10) {
  const ClassProfile remark = ProfileOf(Matrix{{0, 0}, {-1e-3, 0}});
  EXPECT_TRUE(remark.z.yes());
  EXPECT_TRUE(remark.minors.p0.yes());
  EXPECT_TRUE(remark.minors.nondegenerate.no());
  EXPECT_TRUE(remark.m.no());
  EXPECT_TRUE(remark.q.no());
  EXPECT_TRUE(remark.q0.yes());
  const ClassProfile example = ProfileOf(Matrix{{1, 3, 0}, {0, 1, 3}, {3, 0, 1}});
  EXPECT_TRUE(example.minors.p.yes());
  EXPECT_TRUE(example.type_one.yes() && example.type_two.yes() && example.type_three.yes());
  EXPECT_TRUE(example.q.yes() && example.r0.yes());
  EXPECT_TRUE(example.quadratic_form.positive_semidefinite.no());
}

TEST(ClassProfileTest, AnswersBeyondTheExactSize) {
  const Index n = 40;
  const Matrix dominant = Matrix::Constant(n, n, 0.5) + 30 * Matrix::Identity(n, n);
  const MinorClasses p = ClassifyByMinors(dominant);
  EXPECT_TRUE(p.p.yes() && p.p0.yes() && p.nondegenerate.yes() && p.np.no() && p.n.no() && p.pn.no());
  const MinorClasses np = ClassifyByMinors(-dominant);
  EXPECT_TRUE(np.np.yes() && np.nondegenerate.yes() && np.p.no() && np.p0.no());
  Matrix singular = Matrix::Identity(n, n);
  singular.topLeftCorner(2, 2).setOnes();
  EXPECT_FALSE(ClassifyByMinors(singular).p.yes());
  EXPECT_TRUE(ClassifyByMinors(singular).nondegenerate.no());
}

TEST(ClassProfileTest, GivesASectionWithUniqueIds) {
  const AnalysisSection section = ClassSection(Matrix{{2, -1}, {-1, 2}});
  EXPECT_EQ(section.id, "matrix-class");
  for (const Finding& finding : section.findings) {
    EXPECT_FALSE(finding.fact.why.empty()) << finding.id;
    for (const Finding& other : section.findings) EXPECT_EQ(&finding == &other, finding.id == other.id);
  }
}

// No answer contradicts another, and none is open that follows from another.
TEST(ClassProfileTest, DrawsTheConclusionsBetweenClasses) {
  constexpr std::pair<const char*, const char*> kInclusions[] = {
      {"m", "p"},
      {"m", "z"},
      {"z", "hidden-z"},
      {"hidden-z", "q0"},
      {"positive-definite", "p"},
      {"positive-definite", "positive-semidefinite"},
      {"positive-definite", "strictly-copositive"},
      {"positive-semidefinite", "p0"},
      {"positive-semidefinite", "copositive"},
      {"positive-semidefinite", "q0"},
      {"p", "nondegenerate"},
      {"p", "p0"},
      {"p", "strictly-semicopositive"},
      {"n", "nondegenerate"},
      {"np", "nondegenerate"},
      {"pn", "nondegenerate"},
      {"nondegenerate", "r0"},
      {"strictly-copositive", "copositive"},
      {"strictly-copositive", "strictly-semicopositive"},
      {"type-i", "type-ii"},
      {"type-ii", "type-iii"},
      {"type-iii", "strictly-semicopositive"},
      {"strictly-semicopositive", "semicopositive"},
      {"strictly-semicopositive", "r0"},
      {"strictly-semicopositive", "q"},
      {"p0", "semicopositive"},
      {"copositive", "semicopositive"},
      {"q", "s"},
      {"q", "q0"},
  };
  Generator generator(3);
  int yes = 0, no = 0;
  for (int k = 0; k < 60; ++k) {
    const Index n = k % 10 == 0 ? generator.Integer(21, 24) : generator.Integer(1, 5);
    const Matrix M = AsDoubles(generator.Any(n), 0);
    const AnalysisSection section = ClassSection(M);
    const auto answer = [&section](const std::string& id) {
      for (const Finding& finding : section.findings) {
        if (finding.id == id) return finding.fact.answer;
      }
      ADD_FAILURE() << id;
      return Answer::kUnknown;
    };
    for (const auto& [narrow, wide] : kInclusions) {
      if (answer(narrow) == Answer::kYes) {
        EXPECT_EQ(answer(wide), Answer::kYes) << narrow << " in " << wide << "\n" << M;
        ++yes;
      }
      if (answer(wide) == Answer::kNo) {
        EXPECT_EQ(answer(narrow), Answer::kNo) << narrow << " in " << wide << "\n" << M;
        ++no;
      }
    }
  }
  EXPECT_GT(yes, 200);
  EXPECT_GT(no, 200);
}

TEST(QuadraticFormTest, ProvesSemidefinitenessByADominantDiagonal) {
  // The diode bridge: rank one, so no pivot and no eigenvalue decides.
  const Matrix bridge{{0.001, 0.001, -1, 0}, {0.001, 0.001, 0, -1}, {1, 0, 0, 0}, {0, 1, 0, 0}};
  EXPECT_EQ(ClassifyQuadraticForm(bridge).positive_semidefinite.answer, Answer::kYes);
  const Matrix below{{0.001, 0.0010000000000000002}, {0.0010000000000000002, 0.001}};
  EXPECT_NE(ClassifyQuadraticForm(below).positive_semidefinite.answer, Answer::kYes);
}

}  // namespace
}  // namespace dlcs
