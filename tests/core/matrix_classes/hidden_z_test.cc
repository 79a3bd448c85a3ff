// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/hidden_z.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

bool IsZ(const Matrix& X) { return ((X - Matrix(X.diagonal().asDiagonal())).array() <= 0).all(); }

// (4.10) and the proof that no (r, s) can serve column j, by arithmetic.
void ExpectProven(const Matrix& M, const Fact& fact) {
  const Witness& known = fact.witness;
  if (fact.yes()) {
    EXPECT_TRUE(IsZ(known.X)) << known.X;
    EXPECT_TRUE(IsZ(known.Y)) << known.Y;
    const double scale = (M.cwiseAbs() * known.X.cwiseAbs()).maxCoeff();
    EXPECT_LE((M * known.X - known.Y).cwiseAbs().maxCoeff(), 1e-14 * scale);
    EXPECT_GT((known.r.transpose() * known.X + known.s.transpose() * known.Y).minCoeff(), 0);
    EXPECT_GE(known.r.minCoeff(), 0);
    EXPECT_GE(known.s.minCoeff(), 0);
    EXPECT_EQ(known.X.fullPivLu().rank(), M.rows());
  }
  if (fact.no() && !known.indices.empty()) {
    ASSERT_EQ(known.indices.size(), 1u);
    const Index j = known.indices[0];
    Vector image = M.transpose() * known.r;
    EXPECT_GT(image[j], 0);
    image[j] = 0;
    EXPECT_LE(image.maxCoeff(), 0);
    EXPECT_GE((M.row(j) - known.s.transpose() * M).minCoeff(), 0);
    EXPECT_GE(known.r.minCoeff(), 0);
    EXPECT_GE(known.s.minCoeff(), 0);
    EXPECT_EQ(known.r[j], 0);
    EXPECT_EQ(known.s[j], 0);
  }
}

Matrix NegativeMatrix(LcpGenerator& generator, Index n) {
  return Matrix::NullaryExpr(n, n, [&](Index, Index) { return -generator.Uniform(0.1, 1); });
}

TEST(HiddenZTest, TakesAZMatrixAsItIs) {
  LcpGenerator generator(4);
  for (int k = 0; k < 50; ++k) {
    const Index n = generator.Integer(1, 30);
    const Matrix M = NegativeMatrix(generator, n) + generator.Uniform(0, 3) * Matrix::Identity(n, n);
    const Fact fact = TestHiddenZ(M);
    ASSERT_TRUE(fact.yes());
    EXPECT_TRUE(fact.witness.X.isIdentity(0));
    ExpectProven(M, fact);
  }
}

// M = Y X⁻¹ for an M-matrix X and a Z-matrix Y: rᵀX > 0 for r = e.
TEST(HiddenZTest, FindsTheFactorsOfQuotientsOfZMatrices) {
  LcpGenerator generator(11);
  int not_z = 0;
  for (int k = 0; k < 60; ++k) {
    const Index n = generator.Integer(2, 6);
    const double dominance = static_cast<double>(n);
    const Matrix X = NegativeMatrix(generator, n) + dominance * Matrix::Identity(n, n);
    const Matrix Y = NegativeMatrix(generator, n) + generator.Uniform(0, 2 * dominance) * Matrix::Identity(n, n);
    const Matrix M = Y * X.inverse();
    not_z += !IsZ(M);
    const Fact fact = TestHiddenZ(M);
    EXPECT_TRUE(fact.yes()) << fact.why << "\n" << M;
    ExpectProven(M, fact);
  }
  EXPECT_GT(not_z, 20);
}

// X = M⁻¹, Y = I.
TEST(HiddenZTest, FindsInversesOfMMatrices) {
  LcpGenerator generator(12);
  for (int k = 0; k < 30; ++k) {
    const Index n = generator.Integer(2, 6);
    const Matrix M = (NegativeMatrix(generator, n) + n * Matrix::Identity(n, n)).inverse();
    EXPECT_FALSE(IsZ(M));
    const Fact fact = TestHiddenZ(M);
    EXPECT_TRUE(fact.yes()) << fact.why << "\n" << M;
    ExpectProven(M, fact);
  }
}

// Rows and columns in other units: from 1e-5 to 1e5.
TEST(HiddenZTest, FindsTheFactorsWhateverTheUnits) {
  LcpGenerator generator(17);
  for (int k = 0; k < 20; ++k) {
    const Index n = generator.Integer(2, 5);
    const Matrix X = NegativeMatrix(generator, n) + n * Matrix::Identity(n, n);
    const Matrix Y = NegativeMatrix(generator, n) + 2 * n * Matrix::Identity(n, n);
    const Vector units = Vector::NullaryExpr(n, [&](Index) { return std::pow(10, generator.Uniform(-5, 5)); });
    const Matrix M = units.asDiagonal() * Y * X.inverse() * units.asDiagonal();
    EXPECT_FALSE(IsZ(M));
    const Fact fact = TestHiddenZ(M);
    EXPECT_TRUE(fact.yes()) << fact.why << "\n" << M;
    ExpectProven(M, fact);
  }
}

// A row of zeros leaves (MX)_ij = 0, without a margin.
TEST(HiddenZTest, AllowsRowsOfZeros) {
  const Matrix M{{0, 0, 0}, {0, 2, 1}, {0, 1, 2}};
  const Fact fact = TestHiddenZ(M);
  EXPECT_TRUE(fact.yes()) << fact.why;
  ExpectProven(M, fact);
}

// Column 0 asks x_1 <= 0 and x_0 - x_1 <= 0, so x_0 <= 0; then (Mx)_0 = x_0 + x_1 <= 0 as well.
TEST(HiddenZTest, RefutesByAColumnThatNothingCanServe) {
  const Matrix M{{1, 1}, {1, -1}};
  const Fact fact = TestHiddenZ(M);
  EXPECT_TRUE(fact.no()) << fact.why;
  ExpectProven(M, fact);
}

// Whether g lies in the cone of a and b, in the plane.
bool InCone(const Vector& g, const Vector& a, const Vector& b) {
  Matrix basis(2, 2);
  basis << a, b;
  const Vector weights = basis.fullPivLu().solve(g);
  return (basis * weights - g).norm() < 1e-9 && weights.minCoeff() >= -1e-12;
}

// For n = 2 by definition: some g is a combination of e_0, e_1 and the rows M_0, M_1, but neither of e_0, M_0
// nor of e_1, M_1. It may be taken halfway between neighbors among the four directions.
bool IsHiddenZInThePlane(const Matrix& M) {
  std::vector<Vector> generators = {Vector::Unit(2, 0), Vector::Unit(2, 1), M.row(0).transpose(), M.row(1).transpose()};
  std::vector<double> angles;
  for (const Vector& generator : generators) angles.push_back(std::atan2(generator[1], generator[0]));
  std::sort(angles.begin(), angles.end());
  angles.push_back(angles.front() + 2 * std::numbers::pi);
  for (std::size_t k = 0; k + 1 < angles.size(); ++k) {
    const double middle = 0.5 * (angles[k] + angles[k + 1]);
    const Vector g = (Vector(2) << std::cos(middle), std::sin(middle)).finished();
    bool reached = false;
    for (const Vector& a : generators) {
      for (const Vector& b : generators) reached |= InCone(g, a, b);
    }
    if (reached && !InCone(g, generators[0], generators[2]) && !InCone(g, generators[1], generators[3])) return true;
  }
  return false;
}

TEST(HiddenZTest, DecidesMatricesOfSizeTwo) {
  LcpGenerator generator(21);
  int yes = 0, no = 0;
  for (int k = 0; k < 400; ++k) {
    const Matrix M = Matrix::NullaryExpr(2, 2, [&](Index, Index) { return generator.Uniform(-1, 1); });
    const Fact fact = TestHiddenZ(M);
    EXPECT_NE(fact.answer, Answer::kUnknown) << fact.why << "\n" << M;
    EXPECT_EQ(fact.yes(), IsHiddenZInThePlane(M)) << fact.why << "\n" << M;
    ++(fact.yes() ? yes : no);
  }
  EXPECT_GT(yes, 100);
  EXPECT_GT(no, 50);
}

TEST(HiddenZTest, ProvesWhatItSaysOfRandomMatrices) {
  LcpGenerator generator(13);
  int yes = 0, no = 0, unknown = 0;
  for (int k = 0; k < 120; ++k) {
    const Index n = generator.Integer(2, 4);
    const Matrix M = Matrix::NullaryExpr(n, n, [&](Index, Index) { return generator.Uniform(-1, 1); });
    const Fact fact = TestHiddenZ(M);
    ExpectProven(M, fact);
    ++(fact.yes() ? yes : fact.no() ? no : unknown);
  }
  EXPECT_GT(yes, 20);
  EXPECT_GT(no, 60);
  EXPECT_LT(unknown, 8);
}

}  // namespace
}  // namespace dlcs
