// SPDX-License-Identifier: Apache-2.0
// The reference against closed forms.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/hostile/generator.h"
#include "tests/hostile/reference.h"

namespace dlcs::hostile {
namespace {

TEST(HostileReference, KnowsTheBouncingDiode) {
  // x' = -x + y, 0 <= y ⟂ x - 1/2 + 2y >= 0, x(0) = 1: free until ln 2, then x' = -3x/2 + 1/4.
  System system;
  system.A = Eigen::MatrixXd::Constant(1, 1, -1);
  system.B = Eigen::MatrixXd::Constant(1, 1, 1);
  system.N = Eigen::MatrixXd::Constant(1, 1, 1);
  system.M = Eigen::MatrixXd::Constant(1, 1, 2);
  system.x0 = Eigen::VectorXd::Constant(1, 1);
  system.horizon = 3;
  system.functions = {{}};
  system.starts = {0};
  system.F = {Eigen::MatrixXd::Zero(1, 1)};
  system.G = {Eigen::MatrixXd::Constant(1, 1, -0.5)};
  const Reference reference = Refer(system, {0.5, 3});
  ASSERT_EQ(reference.status, Reference::Status::kReached) << reference.reason;
  ASSERT_EQ(reference.event_times.size(), 1u);
  EXPECT_DOUBLE_EQ(reference.event_times[0], std::log(2.0));
  EXPECT_DOUBLE_EQ(reference.x(0, 0), std::exp(-0.5));
  EXPECT_DOUBLE_EQ(reference.x(0, 1), 1.0 / 6 + (0.5 - 1.0 / 6) * std::exp(-1.5 * (3 - std::log(2.0))));
}

// e^{At} of a Jordan block with an eigenvalue of -1e12 beside one of 0, which no exponential in double keeps.
TEST(HostileReference, KeepsSlowModesBesideFastOnes) {
  System system;
  system.A = Eigen::MatrixXd::Zero(3, 3);
  system.A(0, 0) = -1e12;
  system.A(1, 2) = 1;
  system.B = Eigen::MatrixXd::Zero(3, 1);
  system.N = Eigen::MatrixXd::Zero(1, 3);
  system.M = Eigen::MatrixXd::Constant(1, 1, 1);
  system.x0 = Eigen::VectorXd::Ones(3);
  system.horizon = 50;
  system.functions = {{}};
  system.starts = {0};
  system.F = {Eigen::MatrixXd::Zero(3, 1)};
  system.G = {Eigen::MatrixXd::Constant(1, 1, 1)};
  system.F[0](0, 0) = 1e12;
  const Reference reference = Refer(system, {50});
  ASSERT_EQ(reference.status, Reference::Status::kReached) << reference.reason;
  EXPECT_EQ(reference.x(0, 0), 1);
  EXPECT_EQ(reference.x(1, 0), 51);
}

TEST(HostileReference, HasFunctionsRightToThirtyDigits) {
  for (const double a : {0.1, 1.0, 2.5, -7.3, 40.0, 333.3}) {
    const Real sine = Sin(a), cosine = Cos(a);
    EXPECT_EQ(ToDouble(sine), std::sin(a)) << a;
    EXPECT_LT(std::abs(ToDouble(sine * sine + cosine * cosine - Real(1))), 1e-28) << a;
    EXPECT_LT(std::abs(ToDouble(Exp(a) * Exp(-a) - Real(1))), 1e-27) << a;
  }
}

TEST(HostileSystem, IsAFunctionOfItsSeed) {
  EXPECT_EQ(ToJson(MakeSystem(12345)), ToJson(MakeSystem(12345)));
  EXPECT_NE(ToJson(MakeSystem(12345)), ToJson(MakeSystem(12345 + 14)));
}

}  // namespace
}  // namespace dlcs::hostile
