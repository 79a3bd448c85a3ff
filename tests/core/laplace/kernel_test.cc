// SPDX-License-Identifier: Apache-2.0

#include "core/laplace/kernel.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <stop_token>
#include <string>

#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/problems.h"
#include "tests/support/random_matrix.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::RandomMatrix;

// A with the blocks of `spectrum` on its diagonal, seen through a random matrix; B and N random.
Problem WithSpectrum(const Matrix& spectrum, Index n) {
  const Index m = spectrum.rows();
  const Matrix coordinates = RandomMatrix(m, m, 1) + 4 * Matrix::Identity(m, m);
  Problem problem;
  problem.A = coordinates * spectrum * coordinates.inverse();
  problem.B = RandomMatrix(m, n, 2);
  problem.N = RandomMatrix(n, m, 3);
  problem.M = Matrix::Identity(n, n);
  return problem;
}

struct Spectrum {
  const char* name;
  Matrix A;
  double step;
  Index window;
};
void PrintTo(const Spectrum& spectrum, std::ostream* out) { *out << spectrum.name; }

Matrix Diagonal(const Vector& values) { return values.asDiagonal(); }

Matrix Jordan(double lambda, Index order) {
  Matrix jordan = lambda * Matrix::Identity(order, order);
  jordan.diagonal(1).setOnes();
  return jordan;
}

Matrix Oscillators(const std::vector<std::complex<double>>& eigenvalues) {
  Matrix A = Matrix::Zero(2 * eigenvalues.size(), 2 * eigenvalues.size());
  for (size_t k = 0; k < eigenvalues.size(); ++k) {
    const double a = eigenvalues[k].real(), b = eigenvalues[k].imag();
    A.block<2, 2>(2 * k, 2 * k) << a, b, -b, a;
  }
  return A;
}

class SpectraTest : public ::testing::TestWithParam<Spectrum> {};

// Two derivations of the same blocks: powers of e^{hA} and φ-functions, resolvents on contours.
TEST_P(SpectraTest, HasTheBlocksOfThePhiFunctions) {
  const Problem problem = WithSpectrum(GetParam().A, 3);
  const Scheme scheme = ExponentialPiecewiseLinear(problem, GetParam().step);
  Workers workers(2);
  KernelRecord by_phi, by_contour;
  Kernel expected(problem, scheme, KernelSource::kPhiFunctions, workers, by_phi);
  Kernel found(problem, scheme, KernelSource::kContour, workers, by_contour);
  expected.Reserve(GetParam().window, {});
  found.Reserve(GetParam().window, {});
  EXPECT_EQ(by_contour.fallback, "");
  EXPECT_EQ(by_contour.blocks_by_recursion, 0);
  EXPECT_EQ(found.longest_window(), expected.longest_window());
  const Index columns = 3 * by_contour.blocks_by_contour;
  ASSERT_EQ(by_contour.blocks_by_contour, by_phi.blocks_by_recursion);
  EXPECT_GE(by_contour.blocks_by_contour, 5);
  const double size = MaxAbs(expected.blocks().leftCols(columns));
  const double error = MaxAbs(expected.blocks().leftCols(columns) - found.blocks().leftCols(columns)) / size;
  const double recursion_error =
      1e-16 * static_cast<double>(GetParam().window) * GetParam().step * MaxAbs(GetParam().A);
  EXPECT_LT(error, 1e-12 + recursion_error);
}

INSTANTIATE_TEST_SUITE_P(Contours, SpectraTest,
                         ::testing::Values(Spectrum{"decaying", Diagonal(Vector{{-1, -2, -5, -10}}), 0.01, 2000},
                                           Spectrum{"stiff", Diagonal(Vector{{-1e4, -1e3, -1, -1e-3}}), 0.01, 2000},
                                           Spectrum{"with_zero", Diagonal(Vector{{-1, -1, 0, -3}}), 0.01, 2000},
                                           Spectrum{"zero", Diagonal(Vector{{0, 0, 0}}), 0.1, 300},
                                           Spectrum{"unstable", Diagonal(Vector{{1, 0.3, -2, -5}}), 0.01, 900},
                                           Spectrum{"exploding", Diagonal(Vector{{30, -1, -2}}), 0.1, 200},
                                           Spectrum{"defective", Jordan(-1, 4), 0.01, 2000},
                                           Spectrum{"nilpotent", Jordan(0, 3), 0.01, 200},
                                           Spectrum{"imaginary", Oscillators({{0, 1}, {0, 0.5}}), 0.01, 500},
                                           Spectrum{"damped", Oscillators({{-0.5, 3}, {-1, 0.5}}), 0.01, 2000},
                                           Spectrum{"fast_and_damped", Oscillators({{-50, 300}, {-1, 1}}), 0.01, 2000},
                                           Spectrum{"unstable_spiral", Oscillators({{0.5, 1}, {-1, 1}}), 0.01, 600}),
                         [](const auto& test) { return std::string(test.param.name); });

// Closed forms for a diagonal A: K_k = Σ_i N_i e^{(k-1)hλ_i} h φ_1(hλ_i)² B_i. Slow states keep their digits both ways.
TEST(ContourKernelTest, IsAccurateOnStiffSystemsBothWays) {
  const Vector lambda{{-1e7, -1e4, -1, -1e-3}};
  Problem problem = WithSpectrum(Matrix::Identity(4, 4), 3);
  problem.A = Matrix(lambda.asDiagonal());
  constexpr double kStep = 0.01;
  constexpr Index kWindow = 2000;
  Matrix exact(3, 3 * kWindow);
  for (Index k = 0; k < kWindow; ++k) {
    const Vector response = lambda.unaryExpr([&](double value) {
      const double z = kStep * value, phi1 = std::expm1(z) / z;
      if (k > 0) return kStep * std::exp(static_cast<double>(k - 1) * z) * phi1 * phi1;
      return kStep * (z < -1e-3 ? (phi1 - 1) / z : 0.5 + z / 6 + z * z / 24);
    });
    exact.middleCols(3 * k, 3) = problem.N.Dense() * response.asDiagonal() * problem.B.Dense();
  }
  const Scheme scheme = ExponentialPiecewiseLinear(problem, kStep);
  Workers workers(1);
  const auto error = [&](KernelSource source) {
    KernelRecord record;
    Kernel kernel(problem, scheme, source, workers, record);
    kernel.Reserve(kWindow, {});
    EXPECT_EQ(record.fallback, "");
    return MaxAbs(kernel.blocks() - exact) / MaxAbs(exact);
  };
  EXPECT_LT(error(KernelSource::kContour), 1e-13);
  EXPECT_LT(error(KernelSource::kPhiFunctions), 1e-13);
}

// The contours of one kernel must not depend on how it grew.
TEST(ContourKernelTest, HasTheSameBitsHoweverItIsReservedAndForAnyNumberOfThreads) {
  const Problem problem = WithSpectrum(Diagonal(Vector{{-1, -20, -300}}), 2);
  const Scheme scheme = ExponentialPiecewiseLinear(problem, 0.01);
  Workers one(1), three(3);
  KernelRecord record;
  Kernel whole(problem, scheme, KernelSource::kContour, one, record);
  Kernel grown(problem, scheme, KernelSource::kContour, three, record);
  whole.Reserve(500, {});
  for (const Index window : {1, 16, 17, 300, 500}) grown.Reserve(window, {});
  EXPECT_EQ(record.fallback, "");
  EXPECT_TRUE((whole.blocks().leftCols(1000).array() == grown.blocks().leftCols(1000).array()).all());
}

// Few blocks come by the recursion, many by contours, which then go on from where the recursion stopped.
TEST(ContourKernelTest, TakesTheCheaperWayByItself) {
  Vector lambda(60);
  for (Index i = 0; i < 60; ++i) lambda[i] = -std::pow(1.1, static_cast<double>(i));
  const Problem problem = WithSpectrum(lambda.asDiagonal(), 5);
  const Scheme scheme = ExponentialPiecewiseLinear(problem, 0.001);
  Workers workers(1);
  KernelRecord by_phi, chosen;
  Kernel expected(problem, scheme, KernelSource::kPhiFunctions, workers, by_phi);
  Kernel found(problem, scheme, KernelSource::kAuto, workers, chosen);
  found.Reserve(300, {});
  EXPECT_EQ(chosen.blocks_by_recursion, 300);
  EXPECT_EQ(chosen.factorizations, 0);
  found.Reserve(8000, {});
  EXPECT_EQ(chosen.fallback, "");
  EXPECT_EQ(chosen.blocks_by_recursion, 300);
  EXPECT_EQ(chosen.blocks_by_contour, 7700);
  expected.Reserve(8000, {});
  EXPECT_LT(MaxAbs(expected.blocks() - found.blocks()), 1e-12 * MaxAbs(expected.blocks()));
}

TEST(ContourKernelTest, StopsOnRequest) {
  const Problem problem = WithSpectrum(Diagonal(Vector{{-1, -2}}), 1);
  const Scheme scheme = ExponentialPiecewiseLinear(problem, 0.01);
  Workers workers(1);
  std::stop_source source;
  source.request_stop();
  for (const KernelSource way : {KernelSource::kPhiFunctions, KernelSource::kContour}) {
    KernelRecord record;
    Kernel kernel(problem, scheme, way, workers, record);
    kernel.Reserve(100, source.get_token());
    EXPECT_EQ(record.factorizations + record.blocks_by_recursion, 0);
    EXPECT_EQ(record.fallback, "");
    kernel.Reserve(100, {});
    EXPECT_EQ(record.blocks_by_contour + record.blocks_by_recursion, 100);
  }
}

// A pendulum turns 200 rad in the window: its contour would lose all digits. The recursion goes on.
TEST(ContourKernelTest, GivesWayToTheRecursionWhereEigenvaluesTurnTooOften) {
  const Problem problem = WithSpectrum(Oscillators({{0, 20}, {-1, 1}}), 2);
  const Scheme scheme = ExponentialPiecewiseLinear(problem, 0.01);
  Workers workers(1);
  KernelRecord by_phi, by_contour;
  Kernel expected(problem, scheme, KernelSource::kPhiFunctions, workers, by_phi);
  Kernel found(problem, scheme, KernelSource::kContour, workers, by_contour);
  expected.Reserve(1000, {});
  found.Reserve(1000, {});
  EXPECT_NE(by_contour.fallback.find("oscillates too fast"), std::string::npos) << by_contour.fallback;
  EXPECT_GT(by_contour.blocks_by_contour, 10);
  EXPECT_EQ(by_contour.blocks_by_contour + by_contour.blocks_by_recursion, 1000);
  EXPECT_LT(MaxAbs(expected.blocks() - found.blocks().leftCols(2000)), 1e-12 * MaxAbs(expected.blocks()));
}

// The spectrum alone says nothing of a matrix far from normal: here the check does.
TEST(ContourKernelTest, GivesWayToTheRecursionWhereTheResolventIsLargeFarFromTheSpectrum) {
  Problem problem = WithSpectrum(Matrix::Identity(8, 8), 2);
  problem.A = Jordan(-1, 8);
  problem.A.MutableDense().diagonal(1).setConstant(1e3);
  const Scheme scheme = ExponentialPiecewiseLinear(problem, 0.01);
  Workers workers(1);
  KernelRecord by_phi, by_contour;
  Kernel expected(problem, scheme, KernelSource::kPhiFunctions, workers, by_phi);
  Kernel found(problem, scheme, KernelSource::kContour, workers, by_contour);
  expected.Reserve(400, {});
  found.Reserve(400, {});
  const Index count = std::min(expected.blocks().cols(), found.blocks().cols());
  EXPECT_NE(by_contour.fallback, "");
  EXPECT_LT(MaxAbs(expected.blocks().leftCols(count) - found.blocks().leftCols(count)),
            2e-12 * MaxAbs(expected.blocks().leftCols(count)));
}

TEST(ContourKernelTest, GivesTheIterationTheSameAnswer) {
  const auto solve = [](KernelSource source) {
    Options options;
    options.method = Method::kLaplaceIteration;
    options.num_steps = 400;
    options.kernel = source;
    return testing::SolveWith(testing::FourVariableEasy(), options);
  };
  const Solution expected = solve(KernelSource::kPhiFunctions), found = solve(KernelSource::kContour);
  ASSERT_EQ(found.termination, Termination::kReachedEnd) << found.message;
  EXPECT_LT(MaxAbs(expected.x - found.x), 1e-11);
  ASSERT_TRUE(expected.kernel && found.kernel);
  EXPECT_EQ(expected.kernel->factorizations, 0);
  EXPECT_EQ(found.kernel->blocks_by_recursion, 0);
  EXPECT_GT(found.kernel->factorizations, 40);
  EXPECT_EQ(found.kernel->fallback, "");
}

}  // namespace
}  // namespace dlcs
