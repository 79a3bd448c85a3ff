// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/refined_inverse.h"

#include <gtest/gtest.h>

#include "core/linalg/panel_lu.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

// The identity and a large matrix of rank one, of exact entries: (I + u uᵀ/h)⁻¹ = I - u uᵀ/(h + uᵀu).
TEST(RefinedInverseTest, HasTheDigitsThatTheConditionTakes) {
  for (const double e : {0x1p-10, 1.0, 0x1p10}) {
    const Vector u{{1, 1, 1, 2}};
    const Matrix matrix = Matrix::Identity(4, 4) + u * u.transpose() / 0x1p-30;
    const Matrix scaled = matrix * e;
    const Matrix expected = (Matrix::Identity(4, 4) - u * u.transpose() / (0x1p-30 + u.squaredNorm())) / e;
    EXPECT_LT((RefinedInverse(scaled).value() - expected).cwiseAbs().maxCoeff(), 1e-14 / e);
    EXPECT_GT((PanelLu(scaled).Solve(Matrix::Identity(4, 4)) - expected).cwiseAbs().maxCoeff(), 1e-11 / e);
  }
}

TEST(RefinedInverseTest, QuotientsHaveTheirDigitsToo) {
  // The second row of the matrix, but for 1e-7 of the first one: a quotient of 1e-7 and 1, of terms of 1e8.
  const Matrix matrix{{1 + 0x1p-26, 1}, {1, 1}};
  const Matrix rows = 0x1p-23 * matrix.row(0) + matrix.row(1);
  const Matrix quotient = RefinedInverse(matrix).Quotient(rows);
  EXPECT_NEAR(quotient(0, 0), 0x1p-23, 1e-16);
  EXPECT_NEAR(quotient(0, 1), 1, 1e-15);
}

// (1, -1) M⁻¹ = (1, -1) / (2 + r), of terms of 1 / r.
TEST(RefinedInverseTest, QuotientsOfCancelingRowsHaveTheirDigitsToo) {
  const double r = 0x1p-50;
  const Matrix matrix{{1 + r, -1}, {-1, 1 + r}};
  const Matrix quotient = RefinedInverse(matrix).Quotient(Matrix{{1, -1}, {1, 1}});
  EXPECT_NEAR(quotient(0, 0), 1 / (2 + r), 1e-16);
  EXPECT_NEAR(quotient(0, 1), -1 / (2 + r), 1e-16);
  EXPECT_NEAR(quotient(1, 0) * r, 1, 1e-12);
}

TEST(RefinedInverseTest, QuotientsKeepEntriesOfAnySize) {
  const double unit = 0x1p-200, r = 0x1p-20;
  const Matrix matrix{{1, 0, 0}, {unit, 1 + r, -1}, {0, -1, 1 + r}};
  const Matrix quotient = RefinedInverse(matrix).Quotient(Matrix{{3 * unit, 1, -1}});
  EXPECT_NEAR(quotient(0, 0) / unit, 3 - 1 / (2 + r), 1e-15);
}

TEST(RefinedInverseTest, IsThatOfFactorsWhereTheMatrixIsWellConditioned) {
  const Matrix matrix = testing::RandomMatrix(6, 6, 3);
  EXPECT_EQ(RefinedInverse(matrix).value(), PanelLu(matrix).Solve(Matrix::Identity(6, 6)));
}

TEST(RefinedInverseTest, IsNotFiniteForASingularMatrix) {
  EXPECT_FALSE(RefinedInverse(Matrix{{1, 2}, {2, 4}}).value().allFinite());
  EXPECT_EQ(RefinedInverse(Matrix(0, 0)).value().size(), 0);
}

}  // namespace
}  // namespace dlcs
