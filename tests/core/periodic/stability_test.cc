// SPDX-License-Identifier: Apache-2.0
// Stability by multipliers and their errors, judged by matrices whose eigenvalues are known, and by what they are after
// changes within the errors.

#include "core/periodic/stability.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace dlcs {
namespace {

Matrix Rotation(double size, double angle) {
  return size * Matrix{{std::cos(angle), -std::sin(angle)}, {std::sin(angle), std::cos(angle)}};
}

Stability Judge(const Matrix& derivative, double error) {
  return JudgeStability({derivative, Matrix::Constant(derivative.rows(), derivative.cols(), error)}).stability;
}

TEST(StabilityTest, AMultiplierCountsIfItIsFartherFromTheCircleThanItsError) {
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(Judge(Matrix{{sign * 1.001}}, 0.0009), Stability::kUnstable);
    EXPECT_EQ(Judge(Matrix{{sign * 1.001}}, 0.0011), Stability::kUndetermined);
    EXPECT_EQ(Judge(Matrix{{sign * 0.999}}, 0.0009), Stability::kStable);
    EXPECT_EQ(Judge(Matrix{{sign * 0.999}}, 0.0011), Stability::kUndetermined);
    EXPECT_EQ(Judge(Matrix{{sign}}, 1e-16), Stability::kUndetermined);
  }
  EXPECT_EQ(Judge(Rotation(1.017, 0.28), 1e-3), Stability::kUnstable);
  EXPECT_EQ(Judge(Rotation(1.0, 0.28), 1e-9), Stability::kUndetermined);
  EXPECT_EQ(Judge(Rotation(0.99, 0.28), 1e-3), Stability::kStable);
  EXPECT_NEAR(JudgeStability({Rotation(1.017, 0.28), Matrix::Zero(2, 2)}).growth, 0.017, 1e-14);
}

TEST(StabilityTest, OneThatIsKnownToBeOutsideIsEnough) {
  const Matrix both = Vector{{1.5, 1}}.asDiagonal();
  EXPECT_EQ(Judge(both, 1e-9), Stability::kUnstable);
  const Matrix none = Vector{{1, 0.5}}.asDiagonal();
  EXPECT_EQ(Judge(none, 1e-9), Stability::kUndetermined);
}

// Four states that forget their past one after the other: the multiplier 0 four times, with one eigenvector.
TEST(StabilityTest, MultipliersWithoutEigenvectorsOfTheirOwnAreKnown) {
  Matrix shift = Matrix::Zero(4, 4);
  shift.diagonal(1).setConstant(3);
  EXPECT_EQ(Judge(shift, 1e-9), Stability::kStable);
  // Their errors are as large as they may be: with this one in a corner the multipliers are 27e-3^(1/4) i^k.
  Matrix errors = Matrix::Zero(4, 4);
  errors(3, 0) = 1e-3;
  EXPECT_EQ(JudgeStability({shift, errors}).stability, Stability::kStable);
  errors(3, 0) = 1.0 / 26;
  EXPECT_EQ(JudgeStability({shift, errors}).stability, Stability::kUndetermined);
}

TEST(StabilityTest, NothingIsKnownOfWhatIsNotFinite) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(Judge(Matrix{{0.5}}, infinity), Stability::kUndetermined);
  EXPECT_EQ(Judge(Matrix{{0.5}}, std::nan("")), Stability::kUndetermined);
  EXPECT_EQ(Judge(Matrix{{std::nan("")}}, 0), Stability::kUndetermined);
}

// A verdict holds for every matrix within the errors.
TEST(StabilityTest, ChangesWithinTheErrorsDoNotChangeIt) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> entry(-1, 1);
  int stable = 0, unstable = 0;
  for (int k = 0; k < 400; ++k) {
    const Index m = 1 + k % 5;
    const auto any = [&] { return entry(random); };
    Matrix derivative = Matrix::NullaryExpr(m, m, any);
    // The largest multiplier is near 1 in size.
    derivative *= (1 + 0.2 * any()) / (1e-300 + std::abs(MultipliersOf(derivative).front()));
    const Matrix errors = 0.05 * Matrix::NullaryExpr(m, m, any).cwiseAbs();
    const Stability stability = JudgeStability({derivative, errors}).stability;
    if (stability == Stability::kUndetermined) continue;
    ++(stability == Stability::kStable ? stable : unstable);
    for (int change = 0; change < 50; ++change) {
      const Matrix signs = Matrix::NullaryExpr(m, m, any).cwiseSign();
      const double size = std::abs(MultipliersOf(derivative + errors.cwiseProduct(signs)).front());
      EXPECT_EQ(size < 1, stability == Stability::kStable) << derivative << "\n\n" << errors << "\n\n" << signs;
    }
  }
  EXPECT_GT(stable, 50);
  EXPECT_GT(unstable, 50);
}

}  // namespace
}  // namespace dlcs
