// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/split_step.h"

#include <gtest/gtest.h>

#include "core/linalg/norms.h"
#include "core/models/signorini.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

constexpr Index kSize = 20;

Matrix Coupled(double beside) {
  Matrix K = 4 * Matrix::Identity(kSize, kSize);
  for (const Index d : {-2, 2}) K.diagonal(d).setConstant(beside);
  for (const Index d : {-1, 1}) K.diagonal(d).setConstant(-1);
  return K;
}

struct Counted {
  Matrix K;
  int made = 0;
  SplitStep::MakeStep Maker() {
    return [this] {
      ++made;
      return std::make_unique<CoupledStep>(MakeLcpSolver(K, Selection::kUnique), kSize, true);
    };
  }
};

TEST(SplitStepTest, AgreesWithTheDenseSolverWithoutMakingIt) {
  std::srand(1);
  Counted coupled{Coupled(-0.3)};
  SplitStep split(SplitOffBand(coupled.K), coupled.Maker());
  Counted same{coupled.K};
  SplitStep dense(std::nullopt, same.Maker());
  SelectionStats departures;
  for (int k = 0; k < 5; ++k) {
    const Vector q = Vector::Random(kSize);
    Vector y = Vector::Random(kSize), by_dense = y;
    ASSERT_EQ(split.Solve(q, Vector::Zero(kSize), departures, y), LcpStatus::kSolved);
    ASSERT_EQ(dense.Solve(q, Vector::Zero(kSize), departures, by_dense), LcpStatus::kSolved);
    EXPECT_LE(MaxAbs(y - by_dense), 1e-13);
    EXPECT_LE(LcpResidual(coupled.K, q, y), 1e-13);
  }
  EXPECT_EQ(coupled.made, 0);
  EXPECT_EQ(same.made, 1);
}

// A product that is not that of the band: every step is solved all the same.
TEST(SplitStepTest, TakesTheDenseSolverWhereTheSplittingDoesNotContract) {
  Counted coupled{Coupled(-0.3)};
  auto splitting = SplitOffBand(coupled.K);
  splitting->product = BandProduct(-9 * Matrix::Identity(kSize, kSize), 0);
  SplitStep step(splitting, coupled.Maker());
  SelectionStats departures;
  for (int k = 0; k < 5; ++k) {
    const Vector q = Vector::Constant(kSize, -1 - k);
    Vector y = Vector::Zero(kSize);
    ASSERT_EQ(step.Solve(q, Vector::Zero(kSize), departures, y), LcpStatus::kSolved);
    EXPECT_LE(LcpResidual(coupled.K, q, y), 1e-12);
  }
  EXPECT_EQ(coupled.made, 1);
}

// Without states by factors of a band, and with dense matrices by pivoting.
TEST(SplitStepTest, MarchesTheSignoriniProblemAsDenseMatricesDo) {
  for (const double coefficient : {2e-4, 2e-2, 1.0}) {
    auto problem = MakeSignoriniProblem({.cells = 12, .coefficient = coefficient, .horizon = 1});
    ASSERT_TRUE(problem.ok());
    Options options;
    options.method = Method::kExponentialIntegrator;
    options.num_steps = 60;
    options.propagator = PropagatorKind::kKroneckerSum;
    const Solution reduced = testing::SolveToEnd(*problem, options);
    options.propagator = PropagatorKind::kDense;
    const Solution dense = testing::SolveToEnd(*problem, options);
    EXPECT_LE(MaxAbs(reduced.y - dense.y), 1e-11 * (1 + MaxAbs(dense.y))) << coefficient;
    EXPECT_LE(MaxAbs(reduced.x - dense.x), 1e-11 * (1 + MaxAbs(dense.x))) << coefficient;
    EXPECT_LE(reduced.certificate.node_residual, 1e-11 * reduced.certificate.lcp_scale);
    EXPECT_NEAR(reduced.certificate.midpoint_residual, dense.certificate.midpoint_residual, 1e-10);
  }
}

}  // namespace
}  // namespace dlcs
