// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/structured_matrix.h"

#include <gtest/gtest.h>

#include <limits>
#include <unsupported/Eigen/KroneckerProduct>

#include "core/linalg/norms.h"
#include "core/problem/problem.h"

namespace dlcs {
namespace {

SparseMatrix Sparse(const Matrix& dense) { return dense.sparseView(); }

// What the definition says, factor by factor.
Matrix KroneckerSumOf(const Matrix& F, const Matrix& G, const Matrix& H) {
  const auto I = [](const Matrix& matrix) { return Matrix::Identity(matrix.rows(), matrix.rows()).eval(); };
  const auto product = [](const Matrix& a, const Matrix& b) { return Matrix(Eigen::kroneckerProduct(a, b)); };
  return product(F, product(I(G), I(H))) + product(I(F), product(G, I(H))) + product(I(F), product(I(G), H));
}

TEST(StructuredMatrixTest, EveryKindMultipliesAsItsDenseForm) {
  std::srand(7);
  const Matrix F = Matrix::Random(3, 3), G = Matrix::Random(2, 2), H = Matrix::Random(4, 4);
  const KroneckerSum sum{{Sparse(F), Sparse(G), Sparse(H)}};
  const Matrix expected = KroneckerSumOf(F, G, H);
  const Matrix X = Matrix::Random(24, 5);
  const Vector v = Vector::Random(24).cwiseAbs();
  for (const StructuredMatrix& matrix :
       {StructuredMatrix(sum), StructuredMatrix(sum.Assemble()), StructuredMatrix(expected)}) {
    SCOPED_TRACE(matrix.Describe());
    EXPECT_EQ(matrix.rows(), 24);
    EXPECT_EQ(matrix.cols(), 24);
    EXPECT_LE(MaxAbs(matrix.Dense() - expected), 1e-15);
    EXPECT_LE(MaxAbs(Matrix(matrix.Sparse()) - expected), 1e-15);
    EXPECT_LE(MaxAbs(matrix * X - expected * X), 1e-14);
    EXPECT_LE(MaxAbs(matrix * StructuredMatrix(Sparse(X)) - expected * X), 1e-14);
    EXPECT_LE(MaxAbs(matrix.AbsTimes(v) - expected.cwiseAbs() * v), 1e-14);
    EXPECT_NEAR(InfinityNorm(matrix), InfinityNorm(expected), 1e-14);
    EXPECT_NEAR(matrix.MaxAbs(), MaxAbs(expected), 1e-15);
    EXPECT_FALSE(matrix.IsZero());
    EXPECT_TRUE(matrix.AllFinite());
  }
}

// Full diagonals, enough columns and enough lines along the fastest axis for the products that go by diagonals.
TEST(StructuredMatrixTest, MultipliesBandsByTheirDiagonals) {
  std::srand(8);
  const Matrix F = Matrix::Random(3, 3), G = Matrix::Random(4, 4);
  Matrix H = Matrix::Zero(6, 6);
  for (const Index d : {-1, 0, 1}) H.diagonal(d).setRandom();
  const Matrix sum = KroneckerSumOf(F, G, H), X = Matrix::Random(72, 12);
  EXPECT_LE(MaxAbs(StructuredMatrix(KroneckerSum{{Sparse(F), Sparse(G), Sparse(H)}}) * X - sum * X), 1e-14);
  EXPECT_LE(MaxAbs(StructuredMatrix(Sparse(H)) * X.topRows(6) - H * X.topRows(6)), 1e-15);
}

TEST(StructuredMatrixTest, SeesNonFiniteEntriesOfEveryKind) {
  Matrix F = Matrix::Identity(2, 2);
  F(1, 0) = std::numeric_limits<double>::quiet_NaN();
  const KroneckerSum sum{{Sparse(Matrix::Identity(3, 3)), Sparse(F)}};
  for (const StructuredMatrix& matrix : {StructuredMatrix(sum), StructuredMatrix(Sparse(F)), StructuredMatrix(F)}) {
    EXPECT_FALSE(matrix.AllFinite());
    EXPECT_TRUE(std::isnan(matrix.MaxAbs()));
    EXPECT_TRUE(std::isnan(InfinityNorm(matrix)));
  }
}

TEST(StructuredMatrixTest, KnowsWhatDoesNotFit) {
  SparseMatrix line(300, 300);
  line.setIdentity();
  const StructuredMatrix plane{KroneckerSum{{line, line}}};
  EXPECT_EQ(plane.rows(), 90'000);
  EXPECT_FALSE(plane.FitsDense());
  EXPECT_EQ(plane.nonzeros(), 600);
  EXPECT_EQ(plane.Describe(), "Kronecker sum of 300x300 and 300x300");
  const Vector ones = Vector::Ones(90'000);
  EXPECT_EQ(MaxAbs(plane * ones - 2 * ones), 0);
}

Problem StructuredProblem() {
  Problem problem;
  SparseMatrix line(3, 3);
  line.setIdentity();
  problem.A = KroneckerSum{{line, line}};
  problem.B = SparseMatrix(9, 2);
  problem.N = SparseMatrix(2, 9);
  problem.M = Matrix::Identity(2, 2);
  problem.f = TimeFunction::Formulas({"t", "1"});
  problem.f.lift = Matrix::Ones(9, 2);
  problem.g = TimeFunction::Zero(2);
  problem.x0 = Vector::Zero(9);
  problem.horizon = 1;
  return problem;
}

TEST(StructuredMatrixTest, LiftedFunctionsAreProducts) {
  const Problem problem = StructuredProblem();
  EXPECT_TRUE(Validate(problem).empty());
  auto f = TimeFunctionEvaluator::Create(problem.f, 9);
  ASSERT_TRUE(f.ok()) << f.status();
  Vector value(9);
  f->Evaluate(0.25, Side::kRight, value);
  EXPECT_EQ(MaxAbs(value - Vector::Constant(9, 1.25)), 0);
}

TEST(StructuredMatrixTest, ProblemsNameWhatIsWrongInStructures) {
  const auto first = [](const Problem& problem) {
    const std::vector<Violation> violations = Validate(problem);
    return violations.empty() ? "" : violations.front().field + ": " + violations.front().description;
  };
  Problem problem = StructuredProblem();
  problem.A = KroneckerSum{{SparseMatrix(3, 4), SparseMatrix(3, 3)}};
  EXPECT_EQ(first(problem), "A.kronecker_sum.factors[0]: 3x4; must be square, with at least one row");
  problem = StructuredProblem();
  problem.A = KroneckerSum{};
  EXPECT_EQ(first(problem), "A.kronecker_sum: no factors; a Kronecker sum has at least one factor");
  problem = StructuredProblem();
  SparseMatrix B(9, 2);
  B.insert(4, 1) = std::numeric_limits<double>::infinity();
  problem.B = B;
  EXPECT_EQ(first(problem), "B[4][1]: inf; every entry must be finite");
  problem = StructuredProblem();
  problem.f.lift = Matrix::Ones(8, 2);
  EXPECT_EQ(first(problem), "f.lift: 8x2; must have 9 rows");
  problem = StructuredProblem();
  problem.f.lift = Matrix::Ones(9, 3);
  EXPECT_EQ(first(problem), "f.of: 2 components; must be 3");
}

}  // namespace
}  // namespace dlcs
