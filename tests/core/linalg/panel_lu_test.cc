// SPDX-License-Identifier: Apache-2.0

#include "core/linalg/panel_lu.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"
#include "core/parallel/stop_scope.h"
#include "tests/support/random_matrix.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;

// On both sides of where panels begin, and with a last panel that is not full.
constexpr Index kSizes[] = {1, 2, 17, 256, 257, 300, 333};

TEST(PanelLuTest, FactorsMakeTheMatrixAgain) {
  for (const Index size : kSizes) {
    const Matrix A = RandomMatrix(size, size, 1);
    Matrix lu = A;
    std::vector<Index> source;
    FactorInPanels(lu, source);
    Matrix product = lu.triangularView<Eigen::Upper>();
    product = (lu.triangularView<Eigen::UnitLower>() * product).eval();
    EXPECT_LE(MaxAbs(product - Matrix(A(source, Eigen::all))), 1e-14 * static_cast<double>(size) * MaxAbs(A)) << size;
    // Partial pivoting: no multiplier is larger than one.
    EXPECT_LE(MaxAbs(Matrix(lu.triangularView<Eigen::StrictlyLower>())), 1) << size;
  }
}

TEST(PanelLuTest, SolvesForColumns) {
  for (const Index size : kSizes) {
    const Matrix A = RandomMatrix(size, size, 2) + 3 * Matrix::Identity(size, size);
    const Matrix X = RandomMatrix(size, 5, 3);
    EXPECT_LE(MaxAbs(PanelLu(A).Solve(A * X) - X), 1e-9) << size;
  }
}

TEST(PanelLuTest, SingularMatricesGiveNoFiniteSolution) {
  for (const Index size : {Index{5}, Index{300}}) {
    Matrix A = RandomMatrix(size, size, 4);
    A.col(size / 2).setZero();
    EXPECT_FALSE(PanelLu(A).Solve(Matrix::Ones(size, 1)).allFinite()) << size;
  }
}

TEST(PanelLuTest, ProductsInPanelsAreProducts) {
  const Matrix A = RandomMatrix(700, 900, 5), B = RandomMatrix(900, 130, 6);
  EXPECT_LE(MaxAbs(Product(A, B) - A * B), 1e-11);
}

TEST(PanelLuTest, Stops) {
  std::stop_source stop;
  const StopScope scope(stop.get_token());
  const Matrix A = RandomMatrix(300, 300, 7);
  EXPECT_NO_THROW(PanelLu(A).Solve(Product(A, A)));
  stop.request_stop();
  EXPECT_THROW(PanelLu{A}, Stopped);
  EXPECT_THROW(Product(A, A), Stopped);
}

}  // namespace
}  // namespace dlcs
