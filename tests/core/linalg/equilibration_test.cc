// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/equilibration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

TEST(EquilibrationTest, MakesEntriesNearTheEndsOfTheRangeOfSizeOne) {
  for (const double size : {1e-290, 1e-150, 1e150, 1e290}) {
    const Matrix M = size * Matrix{{1, 2}, {2, -3}};
    const Vector symmetric = SymmetricEquilibration(M);
    for (const Matrix& scaled :
         {Matrix(symmetric.asDiagonal() * M * symmetric.asDiagonal()), Scaled(M, EquilibrateRowsAndColumns(M))}) {
      EXPECT_GE(RowMaxAbs(scaled).minCoeff(), 0.25) << size;
      EXPECT_LE(MaxAbs(scaled), 4) << size;
    }
  }
}

// Along the diagonals entries alternate between 1e-290 and 1e290, so no scales of doubles make all of size one.
TEST(EquilibrationTest, ScalesAreFiniteWhereNoneWouldDo) {
  const Matrix M{{1e-290, 1e290, 0, 0}, {0, 1e-290, 1e290, 0}, {0, 0, 1e-290, 1e290}, {0, 0, 0, 1e-290}};
  const Equilibration scale = EquilibrateRowsAndColumns(M);
  for (const Vector& factors : {scale.row, scale.column, SymmetricEquilibration(M)}) {
    EXPECT_TRUE(factors.allFinite()) << factors.transpose();
    EXPECT_GT(factors.minCoeff(), 0);
  }
}

}  // namespace
}  // namespace dlcs
