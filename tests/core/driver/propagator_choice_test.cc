// SPDX-License-Identifier: Apache-2.0
// What is predicted of a solve before it begins, and the forms and propagators that are chosen by that.

#include "core/driver/propagator_choice.h"

#include <gtest/gtest.h>

#include "core/driver/step_memory.h"
#include "core/linalg/sparse/sparse_factor.h"
#include "core/models/signorini.h"
#include "tests/support/sparse_problems.h"

namespace dlcs {
namespace {

using testing::AdvectedGrid;

// A dense A of 400 states with so many nonzeros in a row.
Problem WithNonzerosInARow(Index count) {
  constexpr Index kStates = 400;
  Problem problem;
  Matrix A = -Matrix::Identity(kStates, kStates);
  for (Index i = 0; i < kStates; ++i) {
    for (Index k = 1; k < count; ++k) A(i, (i + k) % kStates) = 1.0 / kStates;
  }
  problem.A = A;
  problem.B = Matrix::Ones(kStates, 1);
  problem.N = Matrix::Ones(1, kStates);
  problem.M = Matrix::Identity(1, 1);
  problem.f = TimeFunction::Zero(kStates);
  problem.g = TimeFunction::Zero(1);
  problem.x0 = Vector::Zero(kStates);
  problem.horizon = 1;
  return problem;
}

TEST(FormToSolveTest, IsSparseWhereHardlyAnyEntryIsNotZero) {
  for (const Index count : {1, 8, 12}) {
    const auto form = FormToSolve(WithNonzerosInARow(count), {});
    ASSERT_TRUE(form) << count;
    EXPECT_FALSE(form->A.is_dense());
    EXPECT_TRUE(form->B.is_dense());
  }
  // A tenth of the products is no gain over dense blocks.
  for (const Index count : {40, 200}) EXPECT_FALSE(FormToSolve(WithNonzerosInARow(count), {})) << count;
}

// Residuals of factors are those of rounding, and no one waits for less than a tenth of a second. Factors of this
// wall take 0.06 s, and each step with them half a millisecond, a third more than with iterations.
TEST(ChoosePropagatorTest, IsIterativeOnlyWhereThatSavesTimeThatCounts) {
  const Problem wall = *MakeSignoriniProblem({.cells = 16, .dimensions = 3, .coefficient = 0.02, .horizon = 1});
  const auto used = [&](Index steps) {
    Options options;
    options.method = Method::kTimeStepping;
    options.estimate_error = false;
    options.num_steps = steps;
    return ChoosePropagator(wall, options, Method::kTimeStepping, Selection::kUnique).record.used;
  };
  for (const Index steps : {10, 50}) EXPECT_EQ(used(steps), PropagatorKind::kSparseStepping) << steps;
  for (const Index steps : {400, 4000}) EXPECT_EQ(used(steps), PropagatorKind::kIterativeStepping) << steps;
}

TEST(SparseStepBytesTest, AreThoseOfTheFactors) {
  for (const double speed : {0.0, 0.4}) {
    const Problem problem = AdvectedGrid({.side = 60, .constraints = 1, .speed = speed});
    const SparseMatrix A = problem.A.Sparse();
    const SparseFactor<double> factor(A, SparseOrder(A), 1, 1e-3);
    const double predicted = SparseStepBytes(problem, PredictFactor(A).nonzeros);
    EXPECT_GT(predicted, factor.bytes() / 2);
    EXPECT_LT(predicted, 2 * factor.bytes());
  }
}

}  // namespace
}  // namespace dlcs
