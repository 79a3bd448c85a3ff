// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <utility>
#include <vector>

#include "core/event_driven/mode_step.h"
#include "core/linalg/decompositions.h"
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
  problem.horizon = 1;
  return problem;
}

std::unique_ptr<Mode> MakeMode(const Problem& problem, std::vector<Index> active) {
  const Index m = problem.num_states(), n = problem.num_constraints();
  return ModeMaker(problem).Make(std::move(active), {Vector::Ones(m), Vector::Ones(m), Vector::Ones(n)});
}

// Chooses a state, sources and y on the active set, and g so that w = 0 there: they satisfy the equations of the mode,
// and its outputs are y and w.
void ExpectEquationsOf(const Problem& problem, const Mode& mode, LcpGenerator& random) {
  const Index m = problem.num_states(), n = problem.num_constraints();
  const Vector x = random.GaussianVector(m), f = random.GaussianVector(m);
  Vector g = random.GaussianVector(n), y = Vector::Zero(n);
  for (const Index i : mode.active) y[i] = random.GaussianVector(1)[0];
  Vector w = problem.N * x + g + problem.M * y;
  for (const Index i : mode.active) {
    g[i] -= w[i];
    w[i] = 0;
  }
  const Vector slope = problem.A * x + problem.B * y + f;
  const Matrix E = mode.is_explicit() ? Matrix(Matrix::Identity(m, m)) : mode.E;
  EXPECT_LT(MaxAbs(E * (slope - f) - mode.F * x - mode.source_g * g), 1e-12);
  EXPECT_LT(MaxAbs(mode.E.bottomRows(mode.num_algebraic)), 1e-300);
  const auto output = [&](const LinearOutput& of) {
    Vector value = of.state * x + of.g * g;
    if (of.slope.size() > 0) value += of.slope * slope + of.f * f;
    return value;
  };
  EXPECT_LT(MaxAbs(output(mode.y) - y), 1e-11);
  Vector guard = w;
  for (const Index i : mode.active) guard[i] = y[i];
  EXPECT_LT(MaxAbs(output(mode.guard) - guard), 1e-11);
}

TEST(ModeTest, IsExplicitWhereMIsRegular) {
  LcpGenerator random(1);
  const Problem problem = RandomProblem(random, 4, 5);
  const auto mode = MakeMode(problem, {0, 2, 3});
  ASSERT_TRUE(mode);
  EXPECT_TRUE(mode->is_explicit());
  ExpectEquationsOf(problem, *mode, random);
}

TEST(ModeTest, ConstrainsTheStateWhereMIsZero) {
  LcpGenerator random(2);
  Problem problem = RandomProblem(random, 5, 4);
  problem.M.MutableDense().setZero();
  const auto mode = MakeMode(problem, {1, 3});
  ASSERT_TRUE(mode);
  EXPECT_EQ(mode->num_algebraic, 2);
  ExpectEquationsOf(problem, *mode, random);
  // The correction brings a state onto N x + g = 0, along B.
  Vector x = random.GaussianVector(5);
  const Vector g = random.GaussianVector(4);
  const Vector change = mode->correction * (mode->algebraic_rows() * x + mode->algebraic_g() * g);
  x -= change;
  const Vector w = problem.N * x + g;
  for (const Index i : {1, 3}) EXPECT_NEAR(w[i], 0, 1e-11);
  const Matrix B_S = problem.B.Dense()(Eigen::all, std::vector<Index>{1, 3});
  EXPECT_LT(MaxAbs(B_S * B_S.colPivHouseholderQr().solve(change) - change), 1e-11);
}

// A singular M_SS that is not zero: one of its rows determines y, two constrain the state.
TEST(ModeTest, ConstrainsTheStateAsFarAsMIsSingular) {
  LcpGenerator random(3);
  Problem problem = RandomProblem(random, 5, 4);
  const Vector u = random.GaussianVector(4);
  problem.M = u * u.transpose();
  const auto mode = MakeMode(problem, {0, 1, 2});
  ASSERT_TRUE(mode);
  EXPECT_EQ(mode->num_algebraic, 2);
  ExpectEquationsOf(problem, *mode, random);
}

// Rows of M_SS that differ in less than twelve digits do not determine y.
TEST(ModeTest, ConstrainsTheStateWhereMIsSingularToTwelveDigits) {
  LcpGenerator random(4);
  Problem problem = RandomProblem(random, 3, 2);
  for (const double difference : {8e-12, 2e-12}) {  // of condition 4 / difference
    problem.M = Matrix{{1, 1}, {1, 1 + difference}};
    const auto mode = MakeMode(problem, {0, 1});
    ASSERT_TRUE(mode);
    EXPECT_EQ(mode->num_algebraic, difference > 4e-12 ? 0 : 1) << difference;
  }
}

// A small M makes fast states, not algebraic equations.
TEST(ModeTest, ASmallMMakesFastStates) {
  LcpGenerator random(6);
  Problem problem = RandomProblem(random, 5, 4);
  problem.M = 1e-9 * random.PositiveDefinite(4);
  problem.N = problem.B.Dense().transpose();
  const auto mode = MakeMode(problem, {0, 1, 2});
  ASSERT_TRUE(mode);
  EXPECT_EQ(mode->num_algebraic, 0);
  EXPECT_FALSE(mode->is_explicit());
  ExpectEquationsOf(problem, *mode, random);
  EXPECT_GT(mode->rate, 1e7);
}

// A row of M determines y even where it is far smaller than B: then the equations of the states stay as they are.
TEST(ModeTest, IsExplicitWhereMIsSmallBesideB) {
  Problem problem;
  problem.A = Matrix{{-1}};
  problem.B = problem.N = Matrix{{1}};
  problem.horizon = 1;
  for (const double M : {1.0, 0.01, 5e-4}) {
    problem.M = Matrix{{M}};
    const auto mode = MakeMode(problem, {0});
    ASSERT_TRUE(mode);
    EXPECT_TRUE(mode->is_explicit()) << M;
  }
}

// The two slacks of an open switch with an off-resistance, w and -w: one is zero, and so is the other one.
TEST(ModeTest, WhatTheOppositeOfAnActiveRowLeavesIsNoRounding) {
  Problem problem;
  problem.A = Matrix::Constant(1, 1, -1);
  problem.B = Matrix::Constant(1, 3, 0.7);
  problem.N = (Matrix(3, 1) << -0.9999998, 0.9999998, 0.0999999).finished();
  problem.M =
      (Matrix(3, 3) << 2.1e-6, -2.1e-6, -0.9999998, -2.1e-6, 2.1e-6, 0.9999998, 0.9999998, -0.9999998, 0.2).finished();
  problem.horizon = 1;
  const auto mode = MakeMode(problem, {0, 2});
  ASSERT_TRUE(mode);
  EXPECT_EQ(mode->guard.state(1, 0), 0);
  EXPECT_EQ(mode->guard.g.row(1), Eigen::RowVector3d(1, 1, 0));
}

TEST(ModeTest, SlidingOfTheRelayIsAMode) {
  const Problem problem = LoadCase("relay_sliding").problem;
  const auto mode = MakeMode(problem, {0, 1});
  ASSERT_TRUE(mode);
  EXPECT_EQ(MaxAbs(mode->dynamics), 0);
  LcpGenerator random(7);
  ExpectEquationsOf(problem, *mode, random);
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

// x' = -D x + 1 y with 1ᵀx = 0. For D = diag(a, b, λ) the eigenvalues are the roots of 3 s² + 2 (a + b + λ) s + (a b +
// a λ + b λ) = 0: one is about -2λ/3, the other about -(a + b)/2.
class FastStateOnAConstraint : public ::testing::TestWithParam<double> {
 protected:
  FastStateOnAConstraint() {
    problem_.A = Matrix(Vector{{-kA, -kB, -fast_}}.asDiagonal());
    problem_.B = Vector::Ones(3);
    problem_.N = Vector::Ones(3).transpose();
    problem_.M = Matrix::Zero(1, 1);
    problem_.horizon = 3;
  }
  double SlowRate() const {
    const double half = kA + kB + fast_, product = kA * kB + (kA + kB) * fast_;
    return product / (half + std::sqrt(half * half - 3 * product));
  }

  static constexpr double kA = 0.3, kB = 1.1;
  const double fast_ = GetParam();
  Problem problem_;
};

TEST_P(FastStateOnAConstraint, SlowEigenvaluesKeepTheirDigits) {
  const auto mode = MakeMode(problem_, {0});
  ASSERT_TRUE(mode);
  double nearest = 1;
  for (const std::complex<double>& eigenvalue : mode->eigenvalues) {
    nearest = std::min(nearest, std::abs(eigenvalue + SlowRate()) / SlowRate());
  }
  EXPECT_LT(nearest, 1e-14);
}

// From the eigenvector v_i = 1/(d_i + s): x(t) = v e^{st}, y = e^{st}.
TEST_P(FastStateOnAConstraint, OneStepFollowsTheSlowSolution) {
  const auto mode = MakeMode(problem_, {0});
  ASSERT_TRUE(mode);
  const double rate = SlowRate(), length = 0.9;
  const double of_fast = -(1 / (kA - rate) + 1 / (kB - rate));  // 1/(λ - rate), without cancellation
  const Vector start{{1 / (kA - rate), 1 / (kB - rate), of_fast}};
  const ModeStepper::Solution solution =
      ModeStepper(*mode, length).Solve(start, LegendreSeries::Zero(3, kLegendreSize), Vector::Zero(3));
  for (const double s : {-0.7, -0.2, 0.6, 1.0}) {
    const LegendreVector at = LegendreValues(s);
    const double factor = std::exp(-rate * length * (1 + s) / 2);
    const Vector x = solution.x * at;
    for (Index i = 0; i < 2; ++i) EXPECT_NEAR(x[i] / start[i], factor, 1e-13) << s;
    const double y = (mode->y.state * x + mode->y.slope * (solution.slope * at))(0);
    EXPECT_NEAR(y, factor, 1e-12) << s;
  }
}
INSTANTIATE_TEST_SUITE_P(Rates, FastStateOnAConstraint, ::testing::Values(2.0, 1e3, 1e6, 1e9, 1e12, 1e14));

Mode ModeOf(const Matrix& dynamics) {
  Problem problem;
  problem.A = dynamics;
  problem.B = Matrix::Zero(dynamics.rows(), 1);
  problem.N = Matrix::Zero(1, dynamics.rows());
  problem.M = Matrix::Identity(1, 1);
  problem.horizon = 1;
  return *MakeMode(problem, {});
}

TEST(ModeStepTest, IsTheExponentialToRounding) {
  LcpGenerator random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Matrix A = random.Gaussian(6, 6);
    const double length = 4 / InfinityNorm(A);
    const Vector start = random.GaussianVector(6);
    const LegendreSeries x =
        ModeStepper(ModeOf(A), length).Solve(start, LegendreSeries::Zero(6, kLegendreSize), Vector::Zero(6)).x;
    const Vector exact = ComputePhiFunctions(length * A).phi0 * start;
    EXPECT_LT(MaxAbs(x.rowwise().sum() - exact), 1e-13 * MaxAbs(exact));
    EXPECT_LT(MaxAbs(x * LegendreValues(-1) - start), 1e-14 * MaxAbs(start));
  }
}

// Kept responses are those of the equations, at the end and before it; with the derivatives where a constraint holds.
void ExpectSameResponsesWhenKept(const Mode& mode, double length) {
  LcpGenerator random(6);
  const Index m = mode.F.rows();
  const Matrix starts = random.Gaussian(m, 3), sources = random.Gaussian(m, 3);
  ModeStepper stepper(mode, length);
  const Matrix before = stepper.RespondAtLooks(starts, sources);
  const ModeStepper::Response end = stepper.Respond(starts, sources, LegendreValues(1));
  const ModeStepper::Response unforced = stepper.Respond(starts, Matrix(), LegendreValues(1));
  stepper.KeepResponses();
  EXPECT_LT(MaxAbs(stepper.RespondAtLooks(starts, sources) - before), 1e-13 * MaxAbs(before));
  const ModeStepper::Response kept = stepper.RespondAt(1, starts, sources);
  EXPECT_LT(MaxAbs(kept.values - end.values), 1e-13 * MaxAbs(end.values));
  ASSERT_EQ(kept.slopes.size(), end.slopes.size());
  EXPECT_LE(MaxAbs(kept.slopes - end.slopes), 1e-13 * MaxAbs(end.slopes));
  EXPECT_LT(MaxAbs(stepper.RespondAt(1, starts, Matrix()).values - unforced.values), 1e-13 * MaxAbs(unforced.values));
}

TEST(ModeStepTest, KeepsResponses) {
  ExpectSameResponsesWhenKept(ModeOf(LcpGenerator(8).Gaussian(5, 5)), 0.7);
  ExpectSameResponsesWhenKept(ModeOf(LcpGenerator(9).Gaussian(20, 20)), 0.2);       // too many states
  ExpectSameResponsesWhenKept(ModeOf(Matrix(Vector{{-1, -1e6}}.asDiagonal())), 1);  // a fast one
}

TEST_P(FastStateOnAConstraint, KeepsResponses) {
  const auto mode = MakeMode(problem_, {0});
  ASSERT_TRUE(mode);
  ExpectSameResponsesWhenKept(*mode, 0.9);
}

// x a polynomial of the degree, b = x' - A x one too: the collocation polynomial is x itself.
TEST(ModeStepTest, FindsPolynomialSolutionsExactly) {
  LcpGenerator random(5);
  const Matrix A = random.Gaussian(4, 4);
  const double length = 0.8;
  LegendreSeries exact = random.Gaussian(4, kLegendreSize);
  for (Index k = 0; k < kLegendreSize; ++k) exact.col(k) /= static_cast<double>((k + 1) * (k + 1));
  const LegendreSeries source = 2 / length * DerivativeOf(exact) - A * exact;
  const Vector start = exact * LegendreValues(-1);
  const LegendreSeries x = ModeStepper(ModeOf(A), length).Solve(start, source, Vector::Zero(start.size())).x;
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
                                 .Solve(Vector::Ones(1), InterpolateAtNodes(values), Vector::Zero(1))
                                 .x;
    for (const double s : {-0.9, -0.3, 0.4, 1.0}) {
      EXPECT_NEAR((x * LegendreValues(s))(0), std::cos(3 * length * (1 + s) / 2), 1e-13) << lambda << " at " << s;
    }
  }
}

// What does not start where it settles leaves a layer on a step that is twenty times the degree longer than that takes.
TEST(ModeStepTest, KnowsALayerWhereTheStepIsFarTooLong) {
  for (const double z : {220.0, 260.0}) {
    const Mode mode = ModeOf(Matrix{{-2 * z}});
    const ModeStepper::Solution step =
        ModeStepper(mode, 1).Solve(Vector{{1}}, LegendreSeries::Zero(1, kLegendreSize), Vector{{0}});
    if (z < 240) {
      EXPECT_EQ(step.layer[0], 0);
    } else {
      EXPECT_GT(std::abs(step.layer[0]), 0.1);
    }
  }
}

TEST(ModeStepTest, DampsWhatItDoesNotResolve) {
  const ModeStepper::Solution solution =
      ModeStepper(ModeOf(Matrix::Constant(1, 1, -1e9)), 1)
          .Solve(Vector::Ones(1), LegendreSeries::Zero(1, kLegendreSize), Vector::Zero(1));
  EXPECT_LT(MaxAbs(solution.x), 1e-6);
  EXPECT_GT(std::abs(solution.layer[0]), 0.1);  // and says that it did not
}

}  // namespace
}  // namespace dlcs
