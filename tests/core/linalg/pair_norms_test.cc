// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/pair_norms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

TEST(PairNormsTest, AreThoseOfTheDefinitionsForAllShapes) {
  std::srand(7);
  for (const Index rows : {1, 2, 7, 8, 9, 16, 23, 255}) {
    for (const Index columns : {1, 3}) {
      const Matrix y = Matrix::Random(rows, columns), w = 2 * Matrix::Random(rows, columns);
      const PairNorms norms = MeasurePairs(y, w);
      EXPECT_EQ(norms.residual, NaturalResidual(y, w));
      EXPECT_EQ(norms.size, std::max(MaxAbs(y), MaxAbs(w)));
      EXPECT_NEAR(norms.complementarity, MaxAbs(y.cwiseProduct(w).colwise().sum()), 1e-15 * static_cast<double>(rows));
    }
  }
  EXPECT_EQ(MeasurePairs(Matrix(0, 2), Matrix(0, 2)).size, 0);
}

TEST(PairNormsTest, ReadColumnsOfLargerMatrices) {
  const Matrix all = Matrix::Random(20, 6);
  const auto y = all.block(1, 0, 17, 3), w = all.block(1, 3, 17, 3);
  EXPECT_EQ(MeasurePairs(y, w).residual, NaturalResidual(y, w));
}

// Whoever stands beside or behind the NaN must not hide it.
TEST(PairNormsTest, SeeNaNWhereverItStands) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const Index rows = 19;
  for (Index at = 0; at < 2 * rows; ++at) {
    for (const bool in_y : {false, true}) {
      Matrix y = Matrix::Ones(rows, 2), w = Matrix::Ones(rows, 2);
      (in_y ? y : w)(at % rows, at / rows) = kNaN;
      const PairNorms norms = MeasurePairs(y, w);
      EXPECT_TRUE(std::isnan(norms.residual)) << at << in_y;
      EXPECT_TRUE(std::isnan(norms.complementarity)) << at << in_y;
      EXPECT_TRUE(std::isnan(norms.size)) << at << in_y;
    }
  }
}

}  // namespace
}  // namespace dlcs
