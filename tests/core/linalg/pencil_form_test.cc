// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/pencil_form.h"

#include <gtest/gtest.h>

#include <complex>

#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;

double Largest(const Eigen::MatrixXcd& matrix) { return matrix.cwiseAbs().maxCoeff(); }

// left (E vectors c' - F vectors c) is slope_triangle c' - triangle c.
void ExpectIsFormOf(const PencilForm& form, const Matrix& E, const Matrix& F, double tolerance) {
  const Eigen::MatrixXcd slope = form.left * E * form.vectors, triangle = form.left * F * form.vectors;
  EXPECT_LT(Largest(slope - form.slope_triangle), tolerance * Largest(form.slope_triangle));
  EXPECT_LT(Largest(triangle - form.triangle), tolerance * Largest(form.triangle));
  EXPECT_LT(Largest(form.vectors * form.inverse - Eigen::MatrixXcd::Identity(E.rows(), E.cols())), tolerance);
  EXPECT_TRUE(Matrix(form.slope_triangle.cwiseAbs().triangularView<Eigen::StrictlyLower>()).isZero(0));
  EXPECT_TRUE(Matrix(form.triangle.cwiseAbs().triangularView<Eigen::StrictlyLower>()).isZero(0));
}

TEST(PencilFormTest, IsTriangularForRandomPencilsWithAlgebraicRows) {
  for (Index algebraic = 1; algebraic < 4; ++algebraic) {
    Matrix E = RandomMatrix(6, 6, static_cast<unsigned>(algebraic));
    const Matrix F = RandomMatrix(6, 6, static_cast<unsigned>(10 + algebraic));
    E.bottomRows(algebraic).setZero();
    const auto form = ComputePencilForm(E, F, algebraic, Vector::Ones(6), 1);
    ASSERT_TRUE(form.has_value());
    ExpectIsFormOf(*form, E, F, 1e-10);
  }
}

// Three phases feed a bridge whose diodes of the first one block: x0 = 0, and x2 = x3. Nothing depends on x0, which is
// a block of G without an entry; the rows x2 - x3 and x0 + x2 - x3 differ in it alone.
TEST(PencilFormTest, KeepsAlgebraicRowsApartThatDifferInAStateNothingDependsOn) {
  Matrix E = Matrix::Zero(4, 4), F(4, 4);
  E.row(0) << 0, 1, 0, 0;
  E.row(1) << 0, 0, 1, 20;
  F << -1e9, -1e9 - 11, -1e9, 0,    //
      -1e9, -1e9, -1e9 - 11, -1e4,  //
      0, 0, -1, 1,                  //
      -1, 0, -1, 1;
  for (const double unit : {1.0, 0x1p-40, 0x1p40}) {
    const Vector units{{unit, 1, 1, 0.25}};
    Matrix scaled_E = E, scaled_F = F;
    scaled_E.col(0) /= unit;
    scaled_F.col(0) /= unit;
    const auto form = ComputePencilForm(scaled_E, scaled_F, 2, units, 0.06);
    ASSERT_TRUE(form.has_value()) << unit;
    // Two coordinates leave the algebraic rows alone, x1 and x2 with x3.
    const Eigen::MatrixXcd rows = scaled_F.bottomRows(2) * form->vectors;
    Index free = 0;
    for (Index j = 0; j < 4; ++j) {
      if (Largest(rows.col(j)) < 1e-12 * Largest(rows)) ++free;
    }
    EXPECT_EQ(free, 2);
    EXPECT_TRUE(form->left.allFinite());
  }
}

// A chain of states with rates from 1e-2 to 1e14, each of which depends on those before; the constraint x1 = 0 is the
// first row. So G = (F - σE)⁻¹E is triangular but for rounding, by which nothing may be scaled.
TEST(PencilFormTest, StatesOfAChainDependOnThoseBeforeAlone) {
  const Vector rates{{1e4, 0.3, 0.2, 8e13, 1e12, 2e13, 7e-3, 1e-2, 6e4, 3e10, 1, 8e6}};
  const Index m = rates.size();
  Matrix E = Matrix::Zero(m, m), F = Matrix::Zero(m, m);
  const Matrix couplings = RandomMatrix(m, m, 7);
  for (Index i = 1; i < m; ++i) {
    E(i - 1, i) = 1;
    E(i - 1, 0) = i < 9 ? 0.05 * (1 + couplings(0, i)) : 0;
    F.row(i - 1).head(i) = rates[i] * couplings.row(i).head(i);
    F(i - 1, i) = -rates[i];
  }
  F(m - 1, 0) = 1;
  const auto form = ComputePencilForm(E, F, 1, Vector::Ones(m), 10);
  ASSERT_TRUE(form.has_value());
  const Eigen::MatrixXcd depends = form->vectors * form->triangle * form->inverse;
  for (Index i = 0; i < m; ++i) {
    for (Index j = i + 1; j < m; ++j) EXPECT_EQ(std::abs(depends(i, j)), 0) << i << " on " << j;
  }
}

TEST(PencilFormTest, IsAbsentForASingularPencil) {
  const Matrix E{{1, 0}, {0, 0}}, F{{1, 0}, {1, 0}};
  EXPECT_FALSE(ComputePencilForm(E, F, 1, Vector::Ones(2), 1).has_value());
}

}  // namespace
}  // namespace dlcs
