// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/secants.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// G(x) = P x + b with P of rank three, far from a contraction: three secants know all of it.
TEST(SecantsTest, FindTheFixedPointOfAnAffineMapOfLowRank) {
  std::srand(8);
  constexpr Index kSize = 40;
  const Matrix P = Matrix::Random(kSize, 3) * Matrix::Random(3, kSize);
  const Vector b = Vector::Random(kSize);
  const Vector fixed_point = (Matrix::Identity(kSize, kSize) - P).lu().solve(b);
  Secants secants(kSize);
  for (int run = 0; run < 2; ++run) {  // the second after Forget()
    Vector x = Vector::Random(kSize);
    for (int step = 0; step < 5; ++step) {
      secants.Add(x, P * x + b);
      if (step == 0) {
        x = P * x + b;
      } else {
        secants.Next(x);
      }
    }
    EXPECT_LE(MaxAbs(x - fixed_point), 1e-10 * MaxAbs(fixed_point));
    secants.Forget();
  }
}

// Steps that others span add nothing, and more than kDepth of them push out the oldest.
TEST(SecantsTest, GoOnWhereStepsRepeatOrAreMany) {
  std::srand(9);
  constexpr Index kSize = 30;
  Matrix P = Matrix::Random(kSize, kSize);
  P *= 0.5 / P.norm();
  const Vector b = Vector::Random(kSize);
  const Vector fixed_point = (Matrix::Identity(kSize, kSize) - P).lu().solve(b);
  Secants secants(kSize);
  Vector x = Vector::Zero(kSize);
  for (int step = 0; step < 25; ++step) {
    secants.Add(x, P * x + b);
    secants.Add(x, P * x + b);
    secants.Next(x);
  }
  EXPECT_LE(MaxAbs(x - fixed_point), 1e-13);
}

}  // namespace
}  // namespace dlcs
