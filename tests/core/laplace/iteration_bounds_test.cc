// SPDX-License-Identifier: Apache-2.0
// The bounds of [Wu & Chen] as numbers, against closed forms and beside what is measured.

#include "core/laplace/iteration_bounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/analysis/laplace_start.h"
#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

TEST(LaplaceBoundsTest, ThetaMaxBoundsEveryTheta) {
  for (const Index nodes : {1, 4, 25, 100}) {
    const Contour contour = SourceContour(nodes);
    for (const int l : {1, 2, 3, 10, 100, 1000}) {
      EXPECT_LE(Theta(contour, l), ThetaMax(contour)) << nodes << " " << l;
      EXPECT_GT(Theta(contour, l), 0);
    }
  }
}

TEST(LaplaceBoundsTest, ResolventFactorOfANormalMatrixIsTheDistanceToItsSpectrum) {
  const Matrix A = Vector{{-1, -10}}.asDiagonal();
  const Contour contour = SourceContour(9);
  double expected = 0;
  for (const ContourNode& node : Nodes(contour)) {
    for (const double lambda : {-1.0, -10.0})
      expected = std::max(expected, std::abs(node.z / 2.0 / (node.z / 2.0 - lambda)));
  }
  EXPECT_NEAR(ResolventFactor(contour, Resolvent(A), {2.0}), expected, 1e-13);
}

TEST(LaplaceBoundsTest, ResolventFactorEndsOnRequest) {
  std::stop_source stop;
  const Contour contour = SourceContour(9);
  const Resolvent resolvent(Matrix::Identity(2, 2) * -1);
  EXPECT_TRUE(std::isfinite(ResolventFactor(contour, resolvent, {1.0}, stop.get_token())));
  stop.request_stop();
  EXPECT_TRUE(std::isnan(ResolventFactor(contour, resolvent, {1.0}, stop.get_token())));
}

TEST(LaplaceBoundsTest, CountsTheIterationsThatTheFactorNeeds) {
  const Contour contour = SourceContour(25);
  for (const double rate : {1e-3, 0.1, 0.5}) {
    IterationBound bound(contour, rate, 1.0);
    const auto count = bound.IterationsFor(1e-12);
    ASSERT_TRUE(count);
    EXPECT_LE(bound.LogFactor(static_cast<int>(*count)), std::log(1e-12));
    EXPECT_GT(bound.LogFactor(static_cast<int>(*count) - 1), std::log(1e-12));
  }
  // Far beyond the exact factors the count is that of Θ_max, which the exact factor must then obey too.
  IterationBound hard(contour, 8, 1.0);
  const auto count = hard.IterationsFor(1e-12);
  ASSERT_TRUE(count);
  EXPECT_GT(*count, IterationBound::kMaxExactFactors);
  EXPECT_LE(hard.LogFactor(static_cast<int>(*count)), std::log(1e-12));
  EXPECT_FALSE(IterationBound(contour, std::numeric_limits<double>::infinity(), 1).IterationsFor(1e-12));
  EXPECT_EQ(IterationBound(contour, 0, 1).IterationsFor(1e-12), 1);
}

TEST(LaplaceBoundsTest, AmplificationIsTheSumOfTheFactors) {
  IterationBound bound(SourceContour(16), 0.3, 2);
  double sum = 0;
  for (int k = 0; k < 400; ++k) sum += std::exp(bound.LogFactor(k));
  EXPECT_NEAR(bound.LogAmplification(), std::log(sum), 1e-12);
}

TEST(LaplaceBoundsTest, ReducedFactorIsTheNormOfThePowersOfItsToeplitzMatrix) {
  // K_{j-l} = r for l <= j in a window of W: row sums of the k-th power.
  const double r = 0.3;
  const Index W = 7;
  const Matrix T = r * Matrix::Ones(W, W).triangularView<Eigen::Lower>().toDenseMatrix();
  Matrix power = Matrix::Identity(W, W);
  for (int k = 0; k <= 9; ++k) {
    EXPECT_NEAR(std::exp(LogReducedFactor(r, W, k)), InfinityNorm(power), 1e-12 * InfinityNorm(power)) << k;
    power = (power * T).eval();
  }
}

TEST(LaplaceBoundsTest, SourceQuadratureErrorBoundsAMeasuredErrorAndFallsLikeTheRootOfP) {
  const Matrix A = Matrix::Constant(1, 1, -3);
  const Resolvent resolvent(A);
  std::vector<double> predicted;
  for (const Index nodes : {9, 25, 64}) {
    const Contour contour = SourceContour(nodes);
    predicted.push_back(SourceQuadratureError(contour, resolvent, A, {1.0}));
    std::complex<double> sum = 0;
    for (const ContourNode& node : Nodes(contour))
      sum += node.weight * (std::exp(node.z) - 1.0) / node.z / (node.z + 3.0);
    const double measured = std::abs(sum.real() - (1 - std::exp(-3.0)) / 3);
    EXPECT_LE(measured, predicted.back()) << nodes;
    EXPECT_LT(predicted.back(), 100 * std::exp(-2.06 * std::sqrt(static_cast<double>(nodes))));
  }
  EXPECT_LT(predicted[2], 1e-3 * predicted[0]);
}

// (2.8): two contours give converged solutions that differ by no more than their predicted errors.
TEST(LaplaceBoundsTest, AccuracyOfTheConvergedSolutionIsAsPredicted) {
  Problem problem = testing::FourVariableEasy();
  problem.horizon = 0.25;  // the amplification grows with T
  const Resolvent resolvent(problem.A);
  Options options;
  options.num_steps = 32;
  Observer silent;
  options.method = Method::kLaplaceIteration;
  const auto exact = Solve(problem, options, silent, {});
  ASSERT_TRUE(exact.ok());
  const double source = MaxAbs(problem.B * exact->y) + 6;  // |f| <= 3, twice for what the iterates do
  options.method = Method::kWuChenIteration;
  for (const Index nodes : {9, 25}) {
    options.num_contour_nodes = nodes;
    const auto solution = Solve(problem, options, silent, {});
    ASSERT_TRUE(solution.ok());
    const Contour contour = SourceContour(nodes);
    const std::vector<double> times{0.25, 0.125, 0.0625, 0.03125, 0.0078125};
    const double quadrature = SourceQuadratureError(contour, resolvent, problem.A, times);
    const double L = *Classify(problem.M).lipschitz;
    IterationBound bound(contour, IterationRate(contour, ResolventFactor(contour, resolvent, times), L, problem), 0.25);
    const double log_predicted = std::log(quadrature * source) + bound.LogAmplification();
    const double measured = MaxAbs(solution->x - exact->x);
    EXPECT_GT(measured, 0);
    EXPECT_LE(std::log(measured), log_predicted);
    // Without the amplification by the coupling it is already of the right size.
    EXPECT_LE(measured, 10 * quadrature * source);
    EXPECT_GE(measured, 1e-4 * quadrature * source);
  }
}

TEST(LaplaceStartTest, ThreeSixIsItsDefinition) {
  EXPECT_TRUE(SatisfiesThreeSix(0.1, 0.5, 1));
  EXPECT_FALSE(SatisfiesThreeSix(0.6, 0.5, 1));             // k = 1: 0.6 + 0.5
  EXPECT_FALSE(SatisfiesThreeSix(0.45, 0.5, 0.9));          // k = 1: 0.45 + 0.45 is not below
  EXPECT_FALSE(SatisfiesThreeSix(0.7, 0.29, 0.93 + 1e-9));  // e^a C_0 = 0.935
  EXPECT_TRUE(SatisfiesThreeSix(1e6, 50, std::numeric_limits<double>::infinity()));
}

// x' = x + y, 0 <= y ⟂ -x + c - y >= 0 with x0 = 0: M = -1 is a Z-matrix, FEA(q) = [0, q] for q >= 0, so ρ = c = β;
// y = 0 is the least element and x^1 = 0 = x: nothing moves, and β a < β ends T* at 1/(L̃ Θ_max), while C_0 e^a < β
// never ends.
TEST(LaplaceStartTest, MatchesAHandComputation) {
  Problem problem = testing::Scalar(-1, 0.5, 0, 1);
  problem.M(0, 0) = -1;
  problem.N(0, 0) = -1;
  const GuaranteedStart start = MeasureGuaranteedStart(problem, Selection::kLeastElement, 4);
  EXPECT_EQ(start.failure, "");
  ASSERT_TRUE(start.radius);
  EXPECT_NEAR(*start.radius, 0.5, 1e-8);
  EXPECT_NEAR(start.beta, 0.5, 1e-8);
  EXPECT_EQ(start.first_move, 0);
  EXPECT_NEAR(start.t_star, 0.25, 1.0 / 256 + 1e-12);
  EXPECT_LT(start.t_star, 0.25);
  EXPECT_EQ(start.t_star_from_x0, 1);
}

// On [0, T*] the iteration from the constant start keeps every LCP feasible.
TEST(LaplaceStartTest, TheIterationStaysFeasibleOnItsInterval) {
  Problem problem = testing::FourVariableHard();
  const Contour contour = SourceContour(25);
  const Resolvent resolvent(problem.A);
  const double L = *Classify(problem.M).lipschitz;
  const double rate = IterationRate(contour, ResolventFactor(contour, resolvent, {1.0, 0.1, 0.01}), L, problem);
  problem.horizon = 1e-3;
  const GuaranteedStart start = MeasureGuaranteedStart(problem, Selection::kLeastElement, rate * ThetaMax(contour));
  EXPECT_EQ(start.failure, "");
  EXPECT_GT(start.t_star, 0);
  EXPECT_GE(start.t_star_from_x0, start.t_star);
  problem.horizon = start.t_star_from_x0;
  Options options;
  options.method = Method::kWuChenIteration;
  options.num_steps = 16;
  Observer silent;
  const auto solution = Solve(problem, options, silent, {});
  ASSERT_TRUE(solution.ok());
  EXPECT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
}

}  // namespace
}  // namespace dlcs
