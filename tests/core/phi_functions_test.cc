// SPDX-License-Identifier: Apache-2.0

#include "core/linalg/phi_functions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

TEST(PhiFunctionsTest, MatchClosedFormsOfScalars) {
  for (const double z : {-1e6, -300.0, -20.0, -1.0, -1e-3, -1e-12, 0.0, 1e-9, 0.3, 2.0, 30.0}) {
    const PhiFunctions phi = ComputePhiFunctions(Matrix::Constant(1, 1, z));
    // Below 1e-3 the closed forms cancel; three terms of the series are exact to 1e-13 there.
    const bool small = std::abs(z) < 1e-3;
    const double phi1 = small ? 1 + z / 2 + z * z / 6 : std::expm1(z) / z;
    const double phi2 = small ? 0.5 + z / 6 + z * z / 24 : (std::expm1(z) - z) / (z * z);
    // Rounding of z itself is magnified by |z| in e^z.
    EXPECT_NEAR(phi.phi0(0, 0), std::exp(z), 4e-16 * (8 + std::abs(z)) * std::exp(z)) << z;
    EXPECT_NEAR(phi.phi1(0, 0) / phi1, 1, 1e-13) << z;
    EXPECT_NEAR(phi.phi2(0, 0) / phi2, 1, z == -1e-3 ? 1e-10 : 1e-13) << z;
  }
}

TEST(PhiFunctionsTest, MatchTheExponentialOfTheAugmentedMatrix) {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  for (const Index m : {1, 2, 5, 12}) {
    for (const double scale : {0.01, 1.0, 10.0}) {
      const Matrix Z = scale * Matrix::NullaryExpr(m, m, [&] { return normal(generator); });
      Matrix augmented = Matrix::Zero(3 * m, 3 * m);
      augmented.topLeftCorner(m, m) = Z;
      augmented.block(0, m, m, m).setIdentity();
      augmented.block(m, 2 * m, m, m).setIdentity();
      const Matrix exponential = augmented.exp();
      const PhiFunctions phi = ComputePhiFunctions(Z);
      const auto near = [&](const Matrix& a, const Matrix& b) { return MaxAbs(a - b) / MaxAbs(b); };
      EXPECT_LT(near(phi.phi0, exponential.block(0, 0, m, m)), 1e-12) << m << " " << scale;
      EXPECT_LT(near(phi.phi1, exponential.block(0, m, m, m)), 1e-12) << m << " " << scale;
      EXPECT_LT(near(phi.phi2, exponential.block(0, 2 * m, m, m)), 1e-12) << m << " " << scale;
    }
  }
}

TEST(PhiFunctionsTest, KeepTheRotationOfAnOscillatorOverManyDoublings) {
  // Z = [0 a; -a 0]: φ_0 is a rotation by a.
  const double a = 1e4;
  Matrix Z(2, 2);
  Z << 0, a, -a, 0;
  const PhiFunctions phi = ComputePhiFunctions(Z);
  EXPECT_NEAR(phi.phi0(0, 0), std::cos(a), 1e-11);
  EXPECT_NEAR(phi.phi0(0, 1), std::sin(a), 1e-11);
  EXPECT_NEAR(phi.phi1(0, 0), std::sin(a) / a, 1e-15);
}

TEST(PhiFunctionsTest, LetNaNThrough) {
  Matrix Z = Matrix::Zero(2, 2);
  Z(0, 1) = NAN;
  EXPECT_FALSE(ComputePhiFunctions(Z).phi0.allFinite());
}

}  // namespace
}  // namespace dlcs
