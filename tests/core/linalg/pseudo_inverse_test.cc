// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/pseudo_inverse.h"

#include <gtest/gtest.h>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

TEST(PseudoInverseTest, RowsThatDifferInTheEleventhDigitAreIndependent) {
  const Vector exact{{2, -1}};
  const Matrix M{{1, 1}, {1, 1 + 5e-11}};
  EXPECT_LE(MaxAbs(FactorOfAnyRank(M).solve(M * exact) - exact), 1e-4);
}

// What the twelfth digit tells apart is rounding: the solution of least norm stays of size one.
TEST(PseudoInverseTest, RowsThatDifferInTheTwelfthDigitAreTheSame) {
  const Matrix M{{1, 1}, {1, 1 + 6e-12}};
  const Vector solution = FactorOfAnyRank(M).solve(Vector{{1, 1 - 6e-12}});
  EXPECT_LE(MaxAbs(solution - Vector::Constant(2, 0.5)), 1e-10);
}

}  // namespace
}  // namespace dlcs
