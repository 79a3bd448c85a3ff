// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/event_driven/mode_step.h"
#include "core/linalg/norms.h"
#include "core/linalg/phi_functions.h"
#include "tests/support/cases.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;
using testing::LoadCase;

Problem RandomProblem(LcpGenerator& random, Index m, Index n) {
  Problem problem;
  problem.A = random.Gaussian(m, m);
  problem.B = random.Gaussian(m, n);
  problem.N = random.Gaussian(n, m);
  problem.M = random.PositiveDefinite(n);
  return problem;
}

TEST(ModeTest, WIsZeroOnTheActiveSetWhereMIsRegular) {
  LcpGenerator random(1);
  const Problem problem = RandomProblem(random, 4, 5);
  const auto mode = MakeMode(problem, {0, 2, 3});
  ASSERT_TRUE(mode);
  EXPECT_FALSE(mode->differentiated());
  const Vector x = random.GaussianVector(4);
  const Vector g = random.GaussianVector(5);
  const Vector y = mode->y.state * x + mode->y.g * g;
  const Vector w = problem.N * x + g + problem.M * y;
  for (const Index i : {0, 2, 3}) EXPECT_NEAR(w[i], 0, 1e-12);
  for (const Index i : {1, 4}) EXPECT_EQ(y[i], 0);
  const Vector guard = mode->guard.state * x + mode->guard.g * g;
  for (const Index i : {0, 2, 3}) EXPECT_NEAR(guard[i], y[i], 1e-12);
  for (const Index i : {1, 4}) EXPECT_NEAR(guard[i], w[i], 1e-12);
  EXPECT_LT(MaxAbs(mode->dynamics * x + mode->source_g * g - (problem.A * x + problem.B * y)), 1e-12);
}

// M = 0: on the active set (N x + g)' = 0, and the state is brought onto N x + g = 0 along B.
TEST(ModeTest, DifferentiatesWhereMIsZero) {
  LcpGenerator random(2);
  Problem problem = RandomProblem(random, 5, 4);
  problem.M.MutableDense().setZero();
  const auto mode = MakeMode(problem, {1, 3});
  ASSERT_TRUE(mode);
  ASSERT_TRUE(mode->differentiated());
  Vector x = random.GaussianVector(5);
  const Vector f = random.GaussianVector(5);
  const Vector g = random.GaussianVector(4);
  const Vector slope = random.GaussianVector(4);
  const Vector y = mode->y.state * x + mode->y.f * f + mode->y.g * g + mode->y.slope * slope;
  const Vector x_slope = problem.A * x + problem.B * y + f;
  const Vector w_slope = problem.N * x_slope + slope;
  for (const Index i : {1, 3}) EXPECT_NEAR(w_slope[i], 0, 1e-11);
  const Vector dynamics =
      mode->dynamics * x + mode->source_f * f + mode->source_g * g + mode->source_slope * slope;
  EXPECT_LT(MaxAbs(dynamics - x_slope), 1e-11);
  x -= mode->correction * (mode->rows * x + mode->rows_g * g);
  const Vector w = problem.N * x + g;
  for (const Index i : {1, 3}) EXPECT_NEAR(w[i], 0, 1e-11);
}

// A singular M_SS that is not zero: part of the equations is algebraic, part is differentiated.
TEST(ModeTest, DifferentiatesOnlyWhatASingularMLeavesOpen) {
  LcpGenerator random(3);
  Problem problem = RandomProblem(random, 5, 4);
  const Vector u = random.GaussianVector(4);
  problem.M = u * u.transpose();
  const auto mode = MakeMode(problem, {0, 1, 2});
  ASSERT_TRUE(mode);
  EXPECT_EQ(mode->rows.rows(), 2);
  Vector x = random.GaussianVector(5);
  const Vector f = random.GaussianVector(5);
  const Vector g = random.GaussianVector(4);
  const Vector slope = Vector::Zero(4);
  x -= mode->correction * (mode->rows * x + mode->rows_g * g);
  const Vector y = mode->y.state * x + mode->y.f * f + mode->y.g * g + mode->y.slope * slope;
  const Vector w = problem.N * x + g + problem.M * y;
  for (const Index i : {0, 1, 2}) EXPECT_NEAR(w[i], 0, 1e-11);
}

TEST(ModeTest, SlidingOfTheRelayIsAMode) {
  const auto mode = MakeMode(LoadCase("relay_sliding").problem, {0, 1});
  ASSERT_TRUE(mode);
  EXPECT_EQ(MaxAbs(mode->dynamics), 0);
  const Vector y = mode->y.f * Vector{{-2, -2}};  // f of the case
  EXPECT_NEAR(y[0], 1, 1e-15);
  EXPECT_NEAR(y[1], 1, 1e-15);
}

TEST(ModeTest, RefusesRelativeDegreeTwo) {
  Problem problem;
  problem.A.MutableDense().resize(2, 2);
  problem.A.MutableDense() << 0, 1, 0, 0;
  problem.B = Vector{{0, 1}};
  problem.N = Vector{{1, 0}}.transpose();
  problem.M = Matrix::Zero(1, 1);
  EXPECT_FALSE(MakeMode(problem, {0}));
  EXPECT_TRUE(MakeMode(problem, {}));
}

Mode ModeOf(const Matrix& dynamics) {
  Problem problem;
  problem.A = dynamics;
  problem.B = Matrix::Zero(dynamics.rows(), 1);
  problem.N = Matrix::Zero(1, dynamics.rows());
  problem.M = Matrix::Identity(1, 1);
  return *MakeMode(problem, {});
}

TEST(ModeStepTest, IsTheExponentialToRounding) {
  LcpGenerator random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Matrix A = random.Gaussian(6, 6);
    const double length = 4 / InfinityNorm(A);
    const Vector start = random.GaussianVector(6);
    const LegendreSeries x = ModeStepper(ModeOf(A), length).Solve(start, LegendreSeries::Zero(6, kLegendreSize)).x;
    const Vector exact = ComputePhiFunctions(length * A).phi0 * start;
    EXPECT_LT(MaxAbs(x.rowwise().sum() - exact), 1e-13 * MaxAbs(exact));
    EXPECT_LT(MaxAbs(x * LegendreValues(-1) - start), 1e-14 * MaxAbs(start));
  }
}

// x a polynomial of the degree, b = x' - A x one too: the collocation polynomial is x itself.
TEST(ModeStepTest, FindsPolynomialSolutionsExactly) {
  LcpGenerator random(5);
  const Matrix A = random.Gaussian(4, 4);
  const double length = 0.8;
  LegendreSeries exact = random.Gaussian(4, kLegendreSize);
  for (Index k = 0; k < kLegendreSize; ++k) exact.col(k) /= static_cast<double>((k + 1) * (k + 1));
  const LegendreSeries source = exact * (2 / length * GetLegendreBasis().derivative) - A * exact;
  const LegendreSeries x = ModeStepper(ModeOf(A), length).Solve(exact * LegendreValues(-1), source).x;
  EXPECT_LT(MaxAbs(x - exact), 1e-13);
}

// x' = λ (x - cos 3t) - 3 sin 3t from cos: as accurate for λ = -1e8 as for -1.
TEST(ModeStepTest, StaysOnTheSlowSolutionOfStiffEquations) {
  const double length = 0.3;
  for (const double lambda : {-1.0, -1e2, -1e4, -1e6, -1e8}) {
    LegendreSeries values(1, kLegendreSize);
    for (Index j = 0; j < kLegendreSize; ++j) {
      const double t = length * (1 + GetLegendreBasis().nodes[j]) / 2;
      values(0, j) = -lambda * std::cos(3 * t) - 3 * std::sin(3 * t);
    }
    const LegendreSeries x = ModeStepper(ModeOf(Matrix::Constant(1, 1, lambda)), length)
                                 .Solve(Vector::Ones(1), InterpolateAtNodes(values))
                                 .x;
    for (const double s : {-0.9, -0.3, 0.4, 1.0}) {
      EXPECT_NEAR((x * LegendreValues(s))(0), std::cos(3 * length * (1 + s) / 2), 1e-13)
          << lambda << " at " << s;
    }
  }
}

TEST(ModeStepTest, DampsWhatItDoesNotResolve) {
  const LegendreSeries x = ModeStepper(ModeOf(Matrix::Constant(1, 1, -1e9)), 1)
                               .Solve(Vector::Ones(1), LegendreSeries::Zero(1, kLegendreSize))
                               .x;
  EXPECT_LT(std::abs(x.sum()), 1e-6);
  EXPECT_GT(EstimateTail(x)[0], 0.1);  // and says that it did not
}

}  // namespace
}  // namespace dlcs
