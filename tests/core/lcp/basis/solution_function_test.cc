// SPDX-License-Identifier: Apache-2.0
// Solutions of LCP(q, M) as functions of q: section 2 of [Chen & Xiang 2013], statement by statement.
#include "core/lcp/basis/solution_function.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/lcp/lcp.h"
#include "core/matrix_classes/lipschitz.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::LcpGenerator;

double NormOf(const Matrix& M) { return M.cwiseAbs().rowwise().sum().maxCoeff(); }

Vector SolutionOf(const Matrix& M, const Vector& q) {
  const auto result = SolveLcp(M, q, SolutionRule::kAuto);
  EXPECT_TRUE(result.ok() && result->verdict == LcpStatus::kSolved) << "M =\n" << M << "\nq = " << q.transpose();
  return result->y;
}

// (I - D + D M)⁻¹ D as written, by a general factorization.
Matrix ByDefinition(const Matrix& M, const std::vector<Index>& J) {
  const Index n = M.rows();
  Matrix D = Matrix::Zero(n, n);
  for (const Index j : J) D(j, j) = 1;
  return (Matrix::Identity(n, n) - D + D * M).inverse() * D;
}

Matrix FiniteDifferences(const Matrix& M, const Vector& q, double step) {
  Matrix jacobian(q.size(), q.size());
  for (Index j = 0; j < q.size(); ++j) {
    Vector ahead = q, behind = q;
    ahead[j] += step;
    behind[j] -= step;
    jacobian.col(j) = (SolutionOf(M, ahead) - SolutionOf(M, behind)) / (2 * step);
  }
  return jacobian;
}

TEST(IndexSetsTest, SplitsIndicesByWhatIsPositive) {
  const Matrix M{{1, 0, 0}, {0, 2, 0}, {0, 0, 1}};
  const IndexSets sets = FindIndexSets(M, Vector{{-1.0, 3, 0}}, Vector{{1.0, 0, 0}});
  EXPECT_THAT(sets.J, ElementsAre(0));
  EXPECT_THAT(sets.I, ElementsAre(1));
  EXPECT_THAT(sets.K, ElementsAre(2));
  EXPECT_TRUE(sets.degenerate());
}

TEST(IndexSetsTest, DoNotDependOnUnits) {
  LcpGenerator generator(1);
  for (int round = 0; round < 200; ++round) {
    const Index n = generator.Integer(1, 7);
    const Matrix M = generator.PositiveDefinite(n);
    const Vector q = generator.GaussianVector(n);
    const Vector y = SolutionOf(M, q);
    const IndexSets sets = FindIndexSets(M, q, y);
    Vector d(n);
    for (Index i = 0; i < n; ++i) d[i] = std::pow(10.0, generator.Uniform(-4, 4));
    const IndexSets scaled = FindIndexSets(d.asDiagonal() * M * d.asDiagonal(), d.cwiseProduct(q), y.cwiseQuotient(d));
    EXPECT_EQ(sets.J, scaled.J);
    EXPECT_EQ(sets.I, scaled.I);
    EXPECT_EQ(sets.K, scaled.K);
  }
}

// The K of the print, { w_i = q_i = 0 }, calls the degenerate solution y = 0 of q = 0 so, but not y = (1, 0) below.
TEST(IndexSetsTest, TakesKFromTheProofsNotFromThePrint) {
  const Matrix M{{1, 0}, {-1, 1}};
  const Vector q{{-1.0, 1}};  // y = (1, 0), w = (0, 0): y is not differentiable at q, and no q_i is zero
  const IndexSets sets = FindIndexSets(M, q, Vector{{1.0, 0}});
  EXPECT_THAT(sets.K, ElementsAre(1));
  const Vector right = (SolutionOf(M, Vector{{-1.0, 1 + 1e-4}}) - SolutionOf(M, q)) / 1e-4;
  const Vector left = (SolutionOf(M, q) - SolutionOf(M, Vector{{-1.0, 1 - 1e-4}})) / 1e-4;
  EXPECT_NEAR(right[1], 0, 1e-9);
  EXPECT_NEAR(left[1], -1, 1e-9);
}

// (2.1), (2.7), (2.9) and Lemma 2.1: P-matrices and Z-matrices that are none, against finite differences.
TEST(ClarkeElementTest, IsTheJacobianWhereTheSolutionIsDifferentiable) {
  LcpGenerator generator(2);
  int compared = 0;
  for (int round = 0; round < 300; ++round) {
    const Index n = generator.Integer(1, 6);
    const bool p = round % 2 == 0;
    const Matrix M = p ? generator.PositiveDefinite(n) : generator.ZMatrix(n);
    Vector q = generator.GaussianVector(n);
    if (!p) q = generator.SolvableQ(M, false) + 0.1 * Vector::Ones(n);  // Lemma 2.2: larger q stay solvable
    const Vector y = SolutionOf(M, q);
    const Vector w = q + M * y;
    if (y.cwiseMax(w).minCoeff() < 1e-3) continue;  // a kink within the reach of the differences
    const IndexSets sets = FindIndexSets(M, q, y);
    EXPECT_TRUE(TestDifferentiable(M, sets).yes());
    const auto element = ClarkeElement(M, sets.J);
    ASSERT_TRUE(element.has_value());
    const double size = 1 + NormOf(*element);
    if (size > 1e3) continue;
    EXPECT_LE((*element + ByDefinition(M, sets.J)).cwiseAbs().maxCoeff(), 1e-10 * size);
    EXPECT_LE((*element - FiniteDifferences(M, q, 1e-6)).cwiseAbs().maxCoeff(), 1e-6 * size);
    EXPECT_LE((*element * q - y).lpNorm<Eigen::Infinity>(), 1e-9 * size);  // Theorem 2.2 (ii)
    ++compared;
  }
  EXPECT_GT(compared, 200);
}

// Theorem 2.1 (2.4) and Theorem 2.2 (iv): q + ε(I - D)e is nondegenerate, and y' there is the element.
TEST(ClarkeElementTest, IsALimitOfJacobiansWhereTheSolutionIsDegenerate) {
  LcpGenerator generator(3);
  int degenerate = 0;
  for (int round = 0; round < 200; ++round) {
    const Index n = generator.Integer(2, 6);
    const Matrix M = round % 2 == 0 ? generator.PositiveDefinite(n) : generator.ZMatrix(n);
    const Vector q = generator.SolvableQ(M, true);
    const Vector y = SolutionOf(M, q);
    const IndexSets sets = FindIndexSets(M, q, y);
    if (!sets.degenerate()) continue;
    ++degenerate;
    EXPECT_TRUE(TestDifferentiable(M, sets).no());
    Vector shifted = q + 1e-2 * Vector::Ones(n);
    for (const Index j : sets.J) shifted[j] = q[j];
    const Vector y_shifted = SolutionOf(M, shifted);
    const IndexSets near = FindIndexSets(M, shifted, y_shifted);
    EXPECT_EQ(near.J, sets.J);
    EXPECT_THAT(near.K, IsEmpty());
    EXPECT_LE((y_shifted - y).lpNorm<Eigen::Infinity>(), 1e-8 * (1 + y.lpNorm<Eigen::Infinity>()));
    EXPECT_TRUE(ClarkeElement(M, sets.J).has_value());
  }
  EXPECT_GT(degenerate, 100);
}

// Theorem 2.2 (i)-(iii) and Lemma 2.2.
TEST(LeastElementFunctionTest, HasNonsingularBlocksAndFallsWithQ) {
  LcpGenerator generator(4);
  for (int round = 0; round < 300; ++round) {
    const Index n = generator.Integer(1, 7);
    const Matrix M = round % 3 == 0 ? generator.SingularMMatrix(n) : generator.ZMatrix(n);
    const Vector q = generator.SolvableQ(M, round % 2 == 0);
    const Vector y = SolutionOf(M, q);
    const std::vector<Index> J = FindIndexSets(M, q, y).J;
    const auto element = ClarkeElement(M, J);
    ASSERT_TRUE(element.has_value());
    EXPECT_LE(NormOf(*element), *LipschitzConstant(M) * (1 + 1e-9));
    const Vector p = q + generator.GaussianVector(n).cwiseAbs();
    const Vector y_p = SolutionOf(M, p);
    EXPECT_LE((y_p - y).maxCoeff(), 1e-9 * (1 + y.lpNorm<Eigen::Infinity>()));
  }
}

// Corollary 2.1 (2.5) and Theorem 2.3 (2.12), which is Lemma 3.1 of [Wu & Chen]: any two q with feasible points.
TEST(LeastElementFunctionTest, IsLipschitzWithTheConstantOfThePaper) {
  LcpGenerator generator(5);
  double sharpest = 0;
  for (int round = 0; round < 400; ++round) {
    const Index n = generator.Integer(1, 6);
    const bool p_matrix = round % 2 == 0;
    const Matrix M = p_matrix ? generator.IndefinitePMatrix(n) : generator.ZMatrix(n);
    const Vector q = p_matrix ? generator.GaussianVector(n) : generator.SolvableQ(M, false);
    const Vector p = p_matrix ? generator.GaussianVector(n) : generator.SolvableQ(M, round % 4 == 1);
    const double change = (SolutionOf(M, q) - SolutionOf(M, p)).lpNorm<Eigen::Infinity>();
    const double bound = *LipschitzConstant(M) * (q - p).lpNorm<Eigen::Infinity>();
    EXPECT_LE(change, bound * (1 + 1e-9) + 1e-12);
    if (bound > 0) sharpest = std::max(sharpest, change / bound);
  }
  EXPECT_GT(sharpest, 0.5);  // the bound is not empty talk
}

TEST(InteriorPointTest, FindsOneOrSaysWhichRowForbidsIt) {
  const Fact found = TestInteriorPoint(testing::ChenXiangExample41(), Vector{{-1.0, 2, 2, 3}});
  ASSERT_TRUE(found.yes()) << found.why;
  const Vector& v = found.witness.z;
  EXPECT_GT(v.minCoeff(), 0);
  EXPECT_GT((Vector{{-1.0, 2, 2, 3}} + testing::ChenXiangExample41() * v).minCoeff(), 0);
  EXPECT_TRUE(TestInteriorPoint(Matrix::Zero(2, 2), Vector{{1.0, 0}}).no());
  EXPECT_TRUE(TestInteriorPoint(Matrix{{1, -1}, {-1, 1}}, Vector{{1.0, -2}}).no());
  EXPECT_EQ(TestInteriorPoint(Matrix{{1, -1}, {-1, 1}}, Vector{{1.0, -1}}).answer, Answer::kUnknown);
}

// Remark 2.1 (ii) is wrong as printed: an interior point, M positive semidefinite, and yet the only solutions on the
// two sides of q stay apart.
TEST(InteriorPointTest, DoesNotMakeSolutionsOfSemidefiniteProblemsLipschitz) {
  const Matrix M{{0, 1}, {-1, 0}};
  EXPECT_TRUE(TestInteriorPoint(M, Vector{{0.0, 1}}).yes());
  for (const double epsilon : {1e-2, 1e-5, 1e-8}) {
    EXPECT_LE((SolutionOf(M, Vector{{-epsilon, 1}}) - Vector{{1.0, epsilon}}).norm(), 1e-12);
    EXPECT_LE(SolutionOf(M, Vector{{epsilon, 1}}).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace dlcs
