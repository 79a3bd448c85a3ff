// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/coupled_least_element.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <memory>
#include <optional>

#include "core/lcp/lcp.h"
#include "core/matrix_classes/lipschitz.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

// The least element of LCP(q, M).
std::optional<Vector> Least(const Matrix& M, const Vector& q) {
  LeastElementSolver solver(M);
  Basis basis(q.size(), 0);
  Vector y(q.size());
  if (solver.Solve(q, Vector::Constant(q.size(), 1e-14), basis, y) != LcpStatus::kSolved) return std::nullopt;
  return y;
}

// How far y is from the least element of LCP(q + K y, M).
double Defect(const Matrix& M, const Matrix& K, const Vector& q, const Vector& y) {
  const std::optional<Vector> least = Least(M, q + K * y);
  return least.has_value() ? (*least - y).lpNorm<Eigen::Infinity>() : std::numeric_limits<double>::infinity();
}

TEST(CoupledLeastElementSolverTest, FindsTheFixedPointWhereTheMapContracts) {
  LcpGenerator generator(1);
  int compared = 0;
  for (int k = 0; k < 2000; ++k) {
    const Index n = generator.Integer(1, 6);
    const Matrix M = k % 3 == 0 ? generator.SingularMMatrix(n) : generator.ZMatrix(n);
    const Matrix K = 1e-3 * generator.Gaussian(n, n);
    const Vector q = generator.GaussianVector(n).array() + 0.7;
    std::optional<Vector> fixed = Least(M, q);
    for (int round = 0; round < 60 && fixed.has_value(); ++round) fixed = Least(M, q + K * *fixed);
    if (!fixed.has_value() || Defect(M, K, q, *fixed) > 1e-12) continue;
    CoupledLeastElementSolver solver(M, K);
    Basis basis(n);
    for (std::uint8_t& entry : basis) entry = static_cast<std::uint8_t>(generator.Integer(0, 1));
    Vector y(n);
    ASSERT_EQ(solver.Solve(q, Vector::Constant(q.size(), 1e-14), basis, y), LcpStatus::kSolved);
    EXPECT_LE(Defect(M, K, q, y), 1e-9 * (1 + y.maxCoeff())) << M << "\n" << q.transpose();
    // The fixed point is the only one where the least element, Lipschitz with constant L, makes a
    // contraction.
    if (*LipschitzConstant(M) * K.cwiseAbs().rowwise().sum().maxCoeff() > 0.9) continue;
    EXPECT_LE((y - *fixed).lpNorm<Eigen::Infinity>(), 1e-8 * (1 + y.maxCoeff()));
    ++compared;
  }
  EXPECT_GT(compared, 500);
}

// Example 4.1 coupled: K acts on the pair (y2, y3) that the least element leaves at zero.
TEST(CoupledLeastElementSolverTest, KeepsTheLeastElementOfExample41FromEveryGuess) {
  const Matrix M = testing::ChenXiangExample41();
  Matrix K = Matrix::Zero(4, 4);
  K(0, 0) = K(3, 3) = 0.03;
  K(0, 3) = K(3, 0) = -0.03;
  K.block(1, 1, 2, 2).setConstant(0.013);
  CoupledLeastElementSolver solver(M, K);
  for (unsigned subset = 0; subset < 16; ++subset) {
    Basis basis(4);
    for (int i = 0; i < 4; ++i) basis[i] = subset >> i & 1u;
    Vector y(4);
    ASSERT_EQ(solver.Solve(Vector{{-0.5, 0.2, 0.2, 0.5}}, Vector::Constant(4, 1e-14), basis, y), LcpStatus::kSolved);
    EXPECT_NEAR(y[0], 0.5 / 1.03, 1e-15) << "guess " << subset;
    EXPECT_EQ(y.tail(3), Vector::Zero(3)) << "guess " << subset;
  }
}

// Implicit Euler by substitution on example (4.2) of [Wu & Chen] with the hard data: M + h N (I - hA)⁻¹ B.
struct Example42 {
  Matrix A = 0.5 * Matrix{{-2, 1, 0}, {1, -2, 1.5}, {0, -1, -2}};
  Matrix B = 0.5 * Matrix{{-1, -4, -2, 0}, {-3, -2, -2, 0}, {-3, -3, 0, 3}};
  Matrix N{{0, 0, -1}, {-2, -2, 1.5}, {-0.5, -1, -0.5}, {1, 2.5, 1.5}};
  Matrix M = testing::WuChenExample42();

  // The time of the first step without a solution, and the state there or at t = 1.
  std::optional<double> March(int steps, Vector& x) const {
    const double h = 1.0 / steps;
    const Matrix resolvent = (Matrix::Identity(3, 3) - h * A).inverse();
    const std::unique_ptr<LcpSolver> solver = MakeCoupledLcpSolver(M, h * N * resolvent * B, Selection::kLeastElement);
    x = Vector{{0.0, -0.5, -0.5}};
    Basis basis(4, 0);
    Vector y(4);
    for (int k = 1; k <= steps; ++k) {
      const double t = k * h;
      const Vector f{{std::sqrt(std::abs(1 - std::cos(t * t))), 3 * std::cos(3 * M_PI * t),
                      std::sqrt(std::abs(1 - std::cos(3 * t * t)))}};
      const Vector g = 2 + t * std::exp(-t / 2) * Vector{{-1.0, 1, 1, -1}}.array();
      const Vector free = resolvent * (x + h * f);
      const Vector q = N * free + g;
      if (solver->Solve(q, Vector::Constant(q.size(), 1e-13), basis, y) != LcpStatus::kSolved) return t;
      EXPECT_LE(LcpResidual(M + h * N * resolvent * B, q, y), 1e-12);
      x = free + h * resolvent * B * y;
    }
    return std::nullopt;
  }
};

TEST(CoupledLeastElementSolverTest, Example42HasNoSolutionForLongImplicitSteps) {
  const Example42 example;
  Vector x;
  for (const int steps : {16, 32, 64}) EXPECT_EQ(example.March(steps, x), 0.4375) << steps;
  for (const int steps : {128, 256, 4096}) {
    EXPECT_EQ(example.March(steps, x), std::nullopt) << steps;
    const Vector exact{{0.091747, -0.200648, 0.497778}};
    EXPECT_LE((x - exact).lpNorm<Eigen::Infinity>(), 3.0 / steps);
  }
}

}  // namespace
}  // namespace dlcs
