// SPDX-License-Identifier: Apache-2.0
// Classes judged by integers: every answer on 10,000 matrices against determinants and adjugates in 128 bits.
#include "core/analysis/class_profile.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/analysis/s_matrix.h"
#include "core/analysis/semicopositive.h"

namespace dlcs {
namespace {

__extension__ using Integer = __int128;
using IntegerMatrix = std::vector<std::vector<std::int64_t>>;

// det of the given rows and columns by expansion along the rows, over all sets of columns: no division, no
// pivoting.
Integer ExactDeterminant(const IntegerMatrix& a, const std::vector<Index>& rows,
                         const std::vector<Index>& cols) {
  const unsigned all = (1u << cols.size()) - 1;
  std::vector<Integer> minor(all + 1, 0);
  minor[0] = 1;
  for (unsigned set = 1; set <= all; ++set) {
    const auto row = static_cast<std::size_t>(rows[static_cast<std::size_t>(std::popcount(set)) - 1]);
    for (std::size_t c = 0; c < cols.size(); ++c) {
      if (!(set >> c & 1u)) continue;
      const int behind = std::popcount(set >> (c + 1));
      const Integer term = minor[set & ~(1u << c)] * a[row][static_cast<std::size_t>(cols[c])];
      minor[set] += behind % 2 == 0 ? term : -term;
    }
  }
  return minor[all];
}

std::vector<Index> Members(unsigned set) {
  std::vector<Index> members;
  for (Index i = 0; i < 32; ++i) {
    if (set >> i & 1u) members.push_back(i);
  }
  return members;
}

int Sign(Integer value) { return (value > 0) - (value < 0); }

struct Truth {
  bool nondegenerate = true, p = true, p0 = true, n = true, np = true, pn = true;
};

Truth ExactMinorClasses(const IntegerMatrix& a) {
  Truth truth;
  for (unsigned set = 1; set < 1u << a.size(); ++set) {
    const std::vector<Index> members = Members(set);
    const int sign = Sign(ExactDeterminant(a, members, members));
    const int alternating = members.size() % 2 == 0 ? 1 : -1;
    truth.nondegenerate &= sign != 0;
    truth.p &= sign > 0;
    truth.p0 &= sign >= 0;
    truth.n &= sign < 0;
    truth.np &= sign == alternating;
    truth.pn &= sign == -alternating;
  }
  return truth;
}

// Strict semicopositivity without linear programs: a smallest S that violates it has an extreme ray z > 0 of
// { z >= 0, M_SS z <= 0 } with all but one row at zero, so ±z is a column of the adjugate of M_SS.
bool ExactlyStrictlySemicopositive(const IntegerMatrix& a) {
  for (unsigned set = 1; set < 1u << a.size(); ++set) {
    const std::vector<Index> members = Members(set);
    const int det = Sign(ExactDeterminant(a, members, members));
    for (std::size_t row = 0; row < members.size(); ++row) {
      int positive = 0, negative = 0;
      for (std::size_t col = 0; col < members.size(); ++col) {
        std::vector<Index> rows = members, cols = members;
        rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(row));
        cols.erase(cols.begin() + static_cast<std::ptrdiff_t>(col));
        const int cofactor = Sign(ExactDeterminant(a, rows, cols)) * ((row + col) % 2 == 0 ? 1 : -1);
        positive += cofactor > 0;
        negative += cofactor < 0;
      }
      const int size = static_cast<int>(members.size());
      // M z = det e_row for the column z of the adjugate.
      if ((positive == size && det <= 0) || (negative == size && det >= 0)) return false;
    }
  }
  return true;
}

IntegerMatrix DoubledSymmetricPart(const IntegerMatrix& a) {
  IntegerMatrix sum = a;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < a.size(); ++j) sum[i][j] = a[i][j] + a[j][i];
  }
  return sum;
}

Matrix AsDoubles(const IntegerMatrix& a, int exponent) {
  const auto n = static_cast<Index>(a.size());
  return Matrix::NullaryExpr(n, n, [&](Index i, Index j) {
    return std::ldexp(static_cast<double>(a[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]),
                      exponent);
  });
}

class Generator {
 public:
  explicit Generator(unsigned seed) : generator_(seed) {}

  std::int64_t Integer(std::int64_t low, std::int64_t high) {
    return std::uniform_int_distribution<std::int64_t>(low, high)(generator_);
  }

  // Members of all the classes, and neighbours of them.
  IntegerMatrix Any(Index n) {
    const auto size = static_cast<std::size_t>(n);
    IntegerMatrix a(size, std::vector<std::int64_t>(size));
    const std::int64_t kind = Integer(0, 9);
    const std::int64_t spread = Integer(1, 9);
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < size; ++j) a[i][j] = Entry(kind, i == j, n, spread);
    }
    if (kind == 7) a = Gram(a, Integer(1, n));
    if (kind == 8 && n > 1) {
      for (std::size_t j = 0; j < size; ++j) a[size - 1][j] = a[0][j] + (n > 2 ? a[1][j] : 0);  // singular
    }
    if (kind == 9) {
      for (std::size_t i = 0; i < size; ++i) {
        for (std::size_t j = 0; j < i; ++j) a[i][j] = -a[j][i];  // skew but for the diagonal
      }
    }
    return a;
  }

 private:
  std::int64_t Entry(std::int64_t kind, bool diagonal, Index n, std::int64_t spread) {
    switch (kind) {
      case 0:  // diagonally dominant: P
        return diagonal ? (n - 1) * spread + Integer(0, 2) : Integer(-spread, spread);
      case 1:  // its negative: NP
        return diagonal ? -(n - 1) * spread - Integer(0, 2) : Integer(-spread, spread);
      case 2:  // Z, an M-matrix or nearly so
        return diagonal ? (n - 1) * spread / 2 + Integer(0, 4) : Integer(-spread, 0);
      case 3:  // near I - 2J: N
        return diagonal ? -100 : -200 + Integer(-spread, spread);
      case 4:  // near 2J - I: PN
        return diagonal ? 100 : 200 + Integer(-spread, spread);
      case 5:  // nonnegative, positive diagonal: type I
        return diagonal ? Integer(1, spread) : Integer(0, spread);
      case 9:
        return diagonal ? Integer(0, 1) : Integer(-spread, spread);
      default:
        return Integer(-spread, spread);
    }
  }

  // B Bᵀ of rank `rank` at most: positive semidefinite.
  static IntegerMatrix Gram(const IntegerMatrix& b, std::int64_t rank) {
    IntegerMatrix a = b;
    for (std::size_t i = 0; i < b.size(); ++i) {
      for (std::size_t j = 0; j < b.size(); ++j) {
        a[i][j] = 0;
        for (std::size_t k = 0; k < static_cast<std::size_t>(rank); ++k) a[i][j] += b[i][k] * b[j][k];
      }
    }
    return a;
  }

  std::mt19937_64 generator_;
};

// Compares answers with the truth and counts the unknown ones.
class Judge {
 public:
  void Answers(const Fact& fact, bool truth, const char* what, const Matrix& M) {
    ++asked_;
    if (fact.answer == Answer::kUnknown) {
      ++unknown_;
      return;
    }
    ++(fact.yes() ? yes_ : no_);
    EXPECT_EQ(fact.yes(), truth) << what << ": " << fact.why << "\n" << M;
  }

  int yes() const { return yes_; }
  int no() const { return no_; }
  double share_of_unknown() const { return static_cast<double>(unknown_) / asked_; }

 private:
  int asked_ = 0, unknown_ = 0, yes_ = 0, no_ = 0;
};

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
  const Truth truth = ExactMinorClasses(a);
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
  const Truth truth = ExactMinorClasses(DoubledSymmetricPart(a));
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

TEST(ClassProfileTest, AgreesWithAdjugatesOnStrictSemicopositivity) {
  Generator generator(1993);
  Judge judge;
  for (int k = 0; k < 600; ++k) {
    const IntegerMatrix a = generator.Any(generator.Integer(1, 4));
    const Matrix M = AsDoubles(a, 0);
    const Fact fact = TestStrictlySemicopositive(M);
    judge.Answers(fact, ExactlyStrictlySemicopositive(a), "strictly semicopositive", M);
    if (!fact.no()) continue;
    const auto& S = fact.witness.indices;
    EXPECT_GE(fact.witness.z.minCoeff(), 0);
    EXPECT_GT(fact.witness.z.maxCoeff(), 0);
    EXPECT_LE((M(S, S) * fact.witness.z).maxCoeff(), 0);
  }
  EXPECT_GT(judge.yes(), 100);
  EXPECT_GT(judge.no(), 100);
  EXPECT_LT(judge.share_of_unknown(), 0.05);
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

}  // namespace
}  // namespace dlcs
