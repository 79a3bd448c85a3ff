// SPDX-License-Identifier: Apache-2.0
// Whole solves of sparse systems: propagated on contours, stepped, and refused where they fit nowhere.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <complex>
#include <string>
#include <utility>
#include <vector>

#include "core/linalg/norms.h"
#include "core/linalg/sparse/sparse_factor.h"
#include "core/matrix_classes/relative_degree.h"
#include "tests/support/solving.h"
#include "tests/support/sparse_problems.h"

namespace dlcs {
namespace {

using testing::AdvectedGrid;
using testing::SolveToEnd;
using testing::SolveWith;
using testing::WithDenseMatrices;

Options With(Method method, PropagatorKind propagator) {
  Options options;
  options.method = method;
  options.propagator = propagator;
  options.num_steps = 50;
  return options;
}

TEST(LargeSparseTest, MarchesAndIteratesOnContoursAsWithDenseMatrices) {
  const Problem problem = AdvectedGrid({.side = 9, .constraints = 4, .speed = 0.4});
  const Solution dense =
      SolveToEnd(WithDenseMatrices(problem), With(Method::kExponentialIntegrator, PropagatorKind::kDense));
  ASSERT_GT(MaxAbs(dense.y), 0.1);
  for (const Method method : {Method::kExponentialIntegrator, Method::kLaplaceIteration}) {
    const Solution solution = SolveToEnd(problem, With(method, PropagatorKind::kContour));
    EXPECT_EQ(solution.propagator.used, PropagatorKind::kContour);
    EXPECT_GT(solution.propagator.terms, 0);
    EXPECT_GT(solution.propagator.factorizations, 0);
    EXPECT_LE(MaxAbs(solution.x - dense.x), 1e-11 * MaxAbs(dense.x)) << MethodName(method);
    EXPECT_LE(MaxAbs(solution.y - dense.y), 1e-11 * MaxAbs(dense.y)) << MethodName(method);
    EXPECT_LE(solution.certificate.node_residual, 1e-11 * solution.certificate.lcp_scale);
    EXPECT_NEAR(solution.certificate.midpoint_residual, dense.certificate.midpoint_residual,
                1e-11 * dense.certificate.lcp_scale);
  }
}

TEST(LargeSparseTest, GoesOnFromRunToRun) {
  Problem problem = AdvectedGrid({.side = 8, .constraints = 3});
  problem.break_points = {0.3, 0.55};
  Options options = With(Method::kExponentialIntegrator, PropagatorKind::kContour);
  const Solution contours = SolveToEnd(problem, options);
  options.propagator = PropagatorKind::kDense;
  const Solution dense = SolveToEnd(WithDenseMatrices(problem), options);
  EXPECT_LE(MaxAbs(contours.x - dense.x), 1e-11 * MaxAbs(dense.x));
}

// The class of M and y at the start are found from its entries, and are those of the dense matrix.
TEST(LargeSparseTest, TakesManyPairsAsADenseMatrixOfThem) {
  constexpr Index kPairs = 1200;
  const auto banded = [](double diagonal, double beside, double beyond) {
    std::vector<Eigen::Triplet<double>> entries;
    for (int i = 0; i < kPairs; ++i) {
      entries.emplace_back(i, i, diagonal);
      for (const auto& [offset, value] : {std::pair(1, beside), std::pair(30, beyond)}) {
        if (i + offset >= kPairs || value == 0) continue;
        entries.emplace_back(i, i + offset, value);
        entries.emplace_back(i + offset, i, value);
      }
    }
    SparseMatrix matrix(kPairs, kPairs);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
  };
  Problem problem;
  problem.A = banded(-4, 1, 1);
  problem.B = problem.N = banded(1, 0, 0);
  problem.M = banded(5, -1, -1);
  problem.f = TimeFunction::Zero(kPairs);
  problem.g = TimeFunction::Constant(Vector::LinSpaced(kPairs, -1, 1));
  problem.x0 = Vector::LinSpaced(kPairs, -0.3, 0.5);
  problem.horizon = 1;
  Options options = With(Method::kTimeStepping, PropagatorKind::kIterativeStepping);
  options.num_steps = 4;
  options.estimate_error = false;
  const Solution sparse = SolveToEnd(problem, options);
  problem.M = problem.M.Dense();
  const Solution dense = SolveToEnd(problem, options);
  ASSERT_GT(MaxAbs(dense.y.col(0)), 0.1);
  EXPECT_LE(MaxAbs(sparse.y - dense.y), 1e-11 * MaxAbs(dense.y));
  EXPECT_LE(MaxAbs(sparse.x - dense.x), 1e-11 * MaxAbs(dense.x));
  EXPECT_LE(sparse.certificate.node_residual, 1e-11 * sparse.certificate.lcp_scale);

  // M = 0, where the state must be consistent.
  problem.M = SparseMatrix(kPairs, kPairs);
  problem.x0 = Vector::LinSpaced(kPairs, 1, 0);
  problem.g = TimeFunction::Constant(Vector::Zero(kPairs));
  EXPECT_EQ(SolveToEnd(problem, options).termination, Termination::kReachedEnd);
  problem.x0[kPairs / 2] = -1;
  EXPECT_EQ(SolveWith(problem, options).termination, Termination::kInconsistentState);
}

// The fill of the factors and the number of steps decide between contours and steps with sparse factors.
TEST(LargeSparseTest, ChoosesStepsOrContoursByTheirPredictedTime) {
  const Problem problem = AdvectedGrid({.side = 20, .constraints = 1});
  Options options;
  options.estimate_error = false;
  options.output_times = {problem.horizon};
  options.output_times_only = true;
  options.num_steps = 400;
  const Solution steps = SolveToEnd(problem, options);
  EXPECT_EQ(steps.method, Method::kTimeStepping);
  EXPECT_EQ(steps.propagator.used, PropagatorKind::kSparseStepping);
  options.num_steps = 40'000;
  const Solution many = SolveToEnd(problem, options);
  EXPECT_EQ(many.method, Method::kExponentialIntegrator);
  EXPECT_EQ(many.propagator.used, PropagatorKind::kContour);
  EXPECT_LE(MaxAbs(steps.x - many.x), 1e-3 * MaxAbs(many.x));
  // Where the method is asked for, so is the matrix exponential.
  options.num_steps = 400;
  options.method = Method::kExponentialIntegrator;
  EXPECT_EQ(SolveToEnd(problem, options).propagator.used, PropagatorKind::kContour);
}

// 90,000 states, whose dense A would take 65 GB.
Problem TooLarge() { return AdvectedGrid({.side = 300, .constraints = 2}); }

// Left to itself the engine steps implicitly where contours would take minutes: half the step, a quarter of the error,
// although the start is rough.
TEST(LargeSparseTest, StepsWhereContoursWouldTakeMinutes) {
  const Problem problem = AdvectedGrid({.side = 150, .constraints = 2, .speed = 0.4});
  const auto state_with = [&](Index steps) {
    Options options;
    options.num_steps = steps;
    options.output_times = {problem.horizon};
    options.output_times_only = true;
    const Solution solution = SolveToEnd(problem, options);
    EXPECT_EQ(solution.propagator.used, PropagatorKind::kSparseStepping) << solution.reason;
    EXPECT_LE(solution.certificate.node_residual, 1e-11 * solution.certificate.lcp_scale);
    return Vector(solution.x.col(0));
  };
  const Vector coarse = state_with(16), middle = state_with(32), fine = state_with(64);
  EXPECT_GT(MaxAbs(coarse - middle), 3 * MaxAbs(middle - fine));
}

// Decoupled rows, written as dense matrices, as whoever fills them in a loop does: the same bits as from their entries.
TEST(LargeSparseTest, StepsSparselyWhereDenseMatricesAreMostlyZero) {
  constexpr Index kSize = 320;
  Problem problem;
  const Matrix identity = Matrix::Identity(kSize, kSize);
  problem.A = Matrix(Vector::LinSpaced(kSize, -1, -2).asDiagonal());
  problem.B = problem.N = problem.M = identity;
  problem.f = TimeFunction::Zero(kSize);
  problem.g = TimeFunction::Constant(Vector::LinSpaced(kSize, -1, 1));
  problem.x0 = Vector::Zero(kSize);
  problem.horizon = 1;
  Options options;
  options.num_steps = 20;
  const Solution dense = SolveToEnd(problem, options);
  EXPECT_EQ(dense.propagator.used, PropagatorKind::kSparseStepping) << dense.reason;
  ASSERT_GT(MaxAbs(dense.y), 0.1);
  for (StructuredMatrix* matrix : {&problem.A, &problem.B, &problem.N, &problem.M}) *matrix = matrix->Sparse();
  EXPECT_EQ(dense.x, SolveToEnd(problem, options).x);
  problem.A = Matrix(problem.A.Dense() + Matrix::Ones(kSize, kSize));
  EXPECT_EQ(SolveToEnd(problem, options).propagator.used, PropagatorKind::kDense);
}

// The one LCP that no step of the iteration solves is that of the start: here N x0 + g = -1 and M = -1, and from the
// first step on y = 0 is a solution.
TEST(LargeSparseTest, IterationOnContoursChecksTheStart) {
  Problem problem = AdvectedGrid({.side = 9, .constraints = 1});
  SparseMatrix M(1, 1);
  M.insert(0, 0) = -1;
  problem.M = StructuredMatrix(M);
  problem.g = TimeFunction::Formulas({"1 - 3*(t < 0.001)"});
  problem.rule = SolutionRule::kLeastNorm;
  const Solution solution = SolveWith(problem, With(Method::kLaplaceIteration, PropagatorKind::kContour));
  EXPECT_EQ(solution.termination, Termination::kInfeasible) << solution.message;
  EXPECT_EQ(solution.failure_time, 0);
  EXPECT_EQ(solution.x.cols(), 0);
}

TEST(LargeSparseTest, RefusesWhatNeedsDenseMatrices) {
  Options newton = With(Method::kTimeStepping, PropagatorKind::kAuto);
  newton.step_solver = StepSolver::kNewton;
  for (const Options& options :
       {With(Method::kWuChenIteration, PropagatorKind::kAuto), With(Method::kEventDriven, PropagatorKind::kAuto),
        With(Method::kExponentialIntegrator, PropagatorKind::kDense),
        With(Method::kTimeStepping, PropagatorKind::kDense), newton}) {
    const Solution solution = SolveWith(TooLarge(), options);
    EXPECT_EQ(solution.termination, Termination::kUnsupported) << MethodName(options.method);
    EXPECT_NE(solution.message.find("m = 90000"), std::string::npos) << solution.message;
  }
}

TEST(LargeSparseTest, RefusesWhatDoesNotFitTheMemoryAndSaysHowMuchItNeeds) {
  Options options = With(Method::kTimeStepping, PropagatorKind::kSparseStepping);
  options.max_memory = 50e6;  // the trajectory at 51 nodes alone takes 37 MB
  const Solution solution = SolveWith(TooLarge(), options);
  EXPECT_EQ(solution.termination, Termination::kUnsupported);
  EXPECT_NE(solution.message.find("--max-memory"), std::string::npos) << solution.message;
  EXPECT_GT(solution.cost.predicted_bytes, 50e6);
  EXPECT_LT(solution.cost.predicted_bytes, 500e6);
}

// Most of what a contour takes are its factors, kept for the states: judged by one of them, and by how many were made.
TEST(LargeSparseTest, PredictsTheMemoryOfContours) {
  const Problem problem = AdvectedGrid({.side = 28, .constraints = 3, .speed = 0.4});
  Options options = With(Method::kExponentialIntegrator, PropagatorKind::kContour);
  options.num_threads = 1;
  options.output_times = {problem.horizon};
  options.output_times_only = true;
  const Solution solution = SolveToEnd(problem, options);
  const SparseMatrix A = problem.A.Sparse();
  const SparseFactor<std::complex<double>> factor(A, SparseOrder(A), {1, 5}, 1);
  const double kept = factor.bytes() * static_cast<double>(solution.propagator.factorizations);
  EXPECT_EQ(solution.propagator.factorizations, solution.propagator.terms);
  EXPECT_GT(solution.cost.predicted_bytes, kept / 2);
  EXPECT_LT(solution.cost.predicted_bytes, 2 * kept);

  options.max_memory = kept / 4;  // fewer are kept then, and made again
  const Solution tight = SolveToEnd(problem, options);
  EXPECT_GT(tight.propagator.factorizations, tight.propagator.terms);
  EXPECT_LE(tight.cost.predicted_bytes, options.max_memory);
  EXPECT_EQ(tight.x, solution.x);

  options.num_threads = 2;  // and fewer are made at a time
  options.max_memory = 4 * factor.bytes();
  const Solution few = SolveToEnd(problem, options);
  EXPECT_THAT(few.propagator.reason,
              ::testing::EndsWith("the memory allowed (--max-memory) is enough for one factorization at a time"));
  EXPECT_EQ(few.x, solution.x);
}

// M = 0 asks for the relative degree, which must not write A down.
TEST(LargeSparseTest, KnowsTheRelativeDegreeOfLargeSystems) {
  const Problem problem = TooLarge();
  SparseMatrix none(2, 2);
  for (const auto& degree : RelativeDegrees(problem.A, problem.B, problem.N, StructuredMatrix(none))) {
    EXPECT_EQ(degree, 1);
  }
  const Problem small = AdvectedGrid({.side = 9, .constraints = 3});
  Problem shifted = small;
  shifted.N = StructuredMatrix(SparseMatrix(small.N.Sparse() * small.A.Sparse()));
  const StructuredMatrix zero(SparseMatrix(3, 3));
  EXPECT_EQ(RelativeDegrees(small.A, small.B, shifted.N, zero),
            RelativeDegrees(small.A.Dense(), small.B.Dense(), shifted.N.Dense(), Matrix::Zero(3, 3)));
}

}  // namespace
}  // namespace dlcs
