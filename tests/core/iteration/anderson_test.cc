// SPDX-License-Identifier: Apache-2.0
#include "core/iteration/anderson.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

Matrix Next(AndersonAcceleration& acceleration, const Matrix& u, Matrix image, const Vector& size) {
  acceleration.Accelerate(u, size, image);
  return image;
}

// For u = T u + c with T of order 6 as many steps as it has eigenvalues are enough, as with GMRES, although T does not
// contract.
TEST(AndersonTest, SolvesLinearFixedPointsInAsManySteps) {
  std::srand(4);
  const Matrix T = 2 * Matrix::Random(6, 6);
  const Vector c = Vector::Random(6), size = Vector::Ones(6);
  const Vector fixed_point = (Matrix::Identity(6, 6) - T).lu().solve(c);
  Workers workers(1);
  AndersonAcceleration acceleration(6, workers);
  Matrix u = Vector::Zero(6);
  for (int k = 0; k < 7; ++k) u = Next(acceleration, u, T * u + c, size);
  EXPECT_LE(MaxAbs(u - fixed_point), 1e-9 * MaxAbs(fixed_point));
}

TEST(AndersonTest, DepthZeroAndTheFirstStepChangeNothing) {
  const Matrix u = Matrix::Random(2, 3), image = Matrix::Random(2, 3);
  Workers workers(1);
  AndersonAcceleration plain(0, workers), first(3, workers);
  EXPECT_EQ(Next(plain, u, image, Vector::Ones(2)), image);
  EXPECT_EQ(Next(first, u, image, Vector::Ones(2)), image);
}

// Rows in units of their own: the same iterates, row by row in other units.
TEST(AndersonTest, DoesNotDependOnUnits) {
  std::srand(5);
  const Matrix T = Matrix::Random(4, 4) / 2;
  const Vector c = Vector::Random(4), unit{{1, 1e6, 1e-6, 3}};
  Workers workers(1);
  AndersonAcceleration plain(3, workers), scaled(3, workers);
  Matrix u = Vector::Zero(4), v = u;
  for (int k = 0; k < 6; ++k) {
    u = Next(plain, u, T * u + c, Vector::Ones(4));
    const Matrix of_v = T * (unit.cwiseInverse().asDiagonal() * v) + c;
    v = Next(scaled, v, unit.asDiagonal() * of_v, unit);
  }
  EXPECT_LE(MaxAbs(unit.cwiseInverse().asDiagonal() * v - u), 1e-8);
}

}  // namespace
}  // namespace dlcs
