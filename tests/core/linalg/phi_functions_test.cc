// SPDX-License-Identifier: Apache-2.0

#include "core/linalg/phi_functions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

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

// The slow state of x' = diag(-λ, -1e-3) x after a thousand steps.
TEST(PhiFunctionsTest, KeepSlowStatesBesideFastOnes) {
  for (const double fast : {1e3, 1e9, 1e14, 1e30}) {
    for (const double coupling : {0.0, 1.0, 1e6}) {
      Matrix A(2, 2);
      A << -fast, coupling, 0, -1e-3;
      const double h = 0.05, slow = 1e-3;
      const PhiFunctions phi = ComputePhiFunctions(h * A);
      Vector x = Vector::Ones(2);
      for (int j = 0; j < 1000; ++j) x = (phi.phi0 * x).eval();
      EXPECT_NEAR(x[1] / std::exp(-slow * h * 1000), 1, 1e-12) << fast;
      // The fast state follows, x_1 = coupling / (λ - 1e-3) x_2.
      EXPECT_NEAR(x[0], coupling / (fast - slow) * x[1], 2e-14 * std::abs(x[0])) << fast;
      EXPECT_NEAR(phi.phi1(1, 1), std::expm1(-h * slow) / (-h * slow), 1e-15);
      EXPECT_NEAR(phi.phi1(0, 0) * h * fast / -std::expm1(-h * fast), 1, 3e-14);
      EXPECT_NEAR(phi.phi2(0, 0) * h * fast / (1 - phi.phi1(0, 0)), 1, 3e-14);
    }
  }
}

// [-λ, λ; 1, -1 - δ] has a slow eigenvalue near -δ, a difference of numbers λ times as large, which one ulp of its
// entries moves by some ulp of 1.
TEST(PhiFunctionsTest, KeepSlowStatesThatAreDifferencesOfLargeEntries) {
  for (const double fast : {0x1p20, 0x1p30, 0x1p40, 0x1p46}) {
    constexpr double kLeak = 0x1p-6, h = 0x1p-5;
    Matrix A(2, 2);
    A << -fast, fast, 1, -1 - kLeak;
    const double trace = fast + 1 + kLeak;
    const double slow = -fast * kLeak * 2 / (trace + std::sqrt(trace * trace - 4 * fast * kLeak));
    const PhiFunctions phi = ComputePhiFunctions(h * A);
    Vector x(2);
    x << fast / (fast + slow), 1;
    for (int j = 0; j < 1000; ++j) x = (phi.phi0 * x).eval();
    EXPECT_NEAR(x[1] / std::exp(slow * h * 1000), 1, 1e-12) << fast;
  }
}

TEST(PhiFunctionsTest, AreTheSameInUnitsThatArePowersOfTwo) {
  std::mt19937 generator(8);
  std::normal_distribution<double> normal;
  const std::vector<int> units = {0, 40, -37, 100, -3};
  const auto in_units = [&](const Matrix& A, int sign) {
    Matrix scaled = A;
    for (Index i = 0; i < 5; ++i) {
      for (Index j = 0; j < 5; ++j) scaled(i, j) = std::ldexp(A(i, j), sign * (units[i] - units[j]));
    }
    return scaled;
  };
  for (const double scale : {0.1, 3.0, 30.0}) {
    Matrix Z = scale * Matrix::NullaryExpr(5, 5, [&] { return normal(generator); });
    Z.diagonal().array() -= 2 * scale;
    const PhiFunctions phi = ComputePhiFunctions(Z), scaled = ComputePhiFunctions(in_units(Z, 1));
    EXPECT_LE(MaxAbs(in_units(scaled.phi0, -1) - phi.phi0), 1e-13 * MaxAbs(phi.phi0));
    EXPECT_LE(MaxAbs(in_units(scaled.phi1, -1) - phi.phi1), 1e-13 * MaxAbs(phi.phi1));
    EXPECT_LE(MaxAbs(in_units(scaled.phi2, -1) - phi.phi2), 1e-13 * MaxAbs(phi.phi2));
  }
}

TEST(PhiFunctionsTest, OfAStepAreThoseAtItsMiddleAndItsEnd) {
  std::mt19937 generator(9);
  std::normal_distribution<double> normal;
  for (const double scale : {0.01, 1.0, 20.0}) {
    const Matrix Z = scale * Matrix::NullaryExpr(4, 4, [&] { return normal(generator); });
    const PhiFunctionsOfStep phi = ComputePhiFunctionsOfStep(Z);
    const PhiFunctions half = ComputePhiFunctions(Z / 2), whole = ComputePhiFunctions(Z);
    EXPECT_LE(MaxAbs(phi.half.phi0 - half.phi0), 1e-13 * MaxAbs(half.phi0));
    EXPECT_LE(MaxAbs(phi.half.phi2 - half.phi2), 1e-13 * MaxAbs(half.phi2));
    EXPECT_LE(MaxAbs(phi.whole.phi0 - whole.phi0), 1e-13 * MaxAbs(whole.phi0));
    EXPECT_LE(MaxAbs(phi.whole.phi1 - whole.phi1), 1e-13 * MaxAbs(whole.phi1));
  }
}

// e^Z = e^-20 [cosh 1, sinh 1; sinh 1, cosh 1]: both states decay to a billionth of one.
TEST(PhiFunctionsTest, KeepTheDigitsOfCoupledStatesThatDecay) {
  const PhiFunctions phi = ComputePhiFunctions(Matrix{{-20, 1}, {1, -20}});
  EXPECT_NEAR(phi.phi0(0, 0) / (std::exp(-20) * std::cosh(1)), 1, 1e-13);
  EXPECT_NEAR(phi.phi0(0, 1) / (std::exp(-20) * std::sinh(1)), 1, 1e-13);
}

TEST(PhiFunctionsTest, LetNaNThrough) {
  Matrix Z = Matrix::Zero(2, 2);
  Z(0, 1) = NAN;
  EXPECT_FALSE(ComputePhiFunctions(Z).phi0.allFinite());
}

}  // namespace
}  // namespace dlcs
