// SPDX-License-Identifier: Apache-2.0
#include "core/problem/mass_matrix.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/analyze.h"
#include "core/linalg/norms.h"
#include "core/problem/options.h"
#include "tests/support/solving.h"
#include "tests/support/sparse_problems.h"

namespace dlcs {
namespace {

using testing::AdvectedGrid;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::SolveToEnd;
using testing::SolveWith;

SparseMatrix Identity(Index size) {
  SparseMatrix identity(size, size);
  identity.setIdentity();
  return identity;
}

// E x' = E A x + E B y + E f: the same solutions.
Problem Weighted(const Problem& problem, const StructuredMatrix& E) {
  Problem weighted = problem;
  weighted.E = E;
  const SparseMatrix mass = E.Sparse();
  weighted.A = StructuredMatrix(SparseMatrix(mass * problem.A.Sparse()));
  weighted.B = StructuredMatrix(SparseMatrix(mass * problem.B.Sparse()));
  weighted.f.lift = E * (problem.f.is_lifted() ? problem.f.lift.Dense() : Matrix::Identity(E.rows(), E.rows()));
  return weighted;
}

Problem Dense(Problem problem) {
  for (StructuredMatrix* matrix : {&problem.A, &problem.B, &problem.N, &problem.M, &problem.E}) {
    *matrix = Matrix(matrix->Sparse());
  }
  return problem;
}

// A grid of 20 × 20 points; E is positive definite, and commutes with A where nothing flows.
Problem Grid(double speed) { return AdvectedGrid({.side = 20, .constraints = 4, .speed = speed}); }
SparseMatrix MassOf(const Problem& grid) { return Identity(grid.num_states()) - 0.002 * grid.A.Sparse(); }

Options AtEnd(Method method, PropagatorKind propagator, Index steps) {
  Options options;
  options.method = method;
  options.propagator = propagator;
  options.num_steps = steps;
  options.output_times = {0.5, 1};
  options.output_times_only = true;
  return options;
}

// `residual`: of the pairs at nodes; iterative steps leave 2e-13 of the terms of their equations.
void ExpectSame(const Solution& with, const Solution& without, double tolerance, double residual = 1e-12) {
  ASSERT_EQ(with.x.cols(), without.x.cols());
  EXPECT_GT(MaxAbs(without.y), 0.1);
  EXPECT_LE(MaxAbs(with.x - without.x), tolerance * MaxAbs(without.x));
  EXPECT_LE(MaxAbs(with.y - without.y), tolerance * MaxAbs(without.y));
  EXPECT_LE(with.certificate.node_residual, residual * with.certificate.lcp_scale);
}

TEST(MassMatrixTest, SparseStepsSolveTheSystemThatIsWeighted) {
  for (const double speed : {0.0, 8.0}) {
    const Problem plain = Grid(speed);
    const Problem weighted = Weighted(plain, MassOf(plain));
    for (const bool average : {false, true}) {
      Options options = AtEnd(Method::kTimeStepping, PropagatorKind::kSparseStepping, 60);
      options.average_y = average;
      options.theta = average ? 0 : 0.25;
      const Solution with = SolveToEnd(weighted, options);
      EXPECT_EQ(with.propagator.used, PropagatorKind::kSparseStepping);
      ExpectSame(with, SolveToEnd(plain, options), 1e-11);
    }
    // Two stages.
    const Options options = AtEnd(Method::kAuto, PropagatorKind::kSparseStepping, 60);
    const Solution with = SolveToEnd(weighted, options), without = SolveToEnd(plain, options);
    ExpectSame(with, without, 1e-11);
    EXPECT_LE(with.certificate.drift_of_rows, 2 * without.certificate.drift_of_rows);
  }
}

TEST(MassMatrixTest, IterativeStepsSolveTheSystemThatIsWeighted) {
  for (const double speed : {0.0, 8.0}) {
    const Problem plain = Grid(speed);
    SparseMatrix E = MassOf(plain);
    const Vector sizes = Vector::LinSpaced(E.rows(), 1e-6, 1e-2);  // as of elements of different sizes
    E = SparseMatrix(sizes.cwiseSqrt().asDiagonal() * E * sizes.cwiseSqrt().asDiagonal());
    for (const Method method : {Method::kTimeStepping, Method::kAuto}) {
      const Options options = AtEnd(method, PropagatorKind::kIterativeStepping, 60);
      const Solution with = SolveToEnd(Weighted(plain, E), options);
      EXPECT_EQ(with.propagator.used, PropagatorKind::kIterativeStepping);
      ExpectSame(with, SolveToEnd(plain, AtEnd(method, PropagatorKind::kSparseStepping, 60)), 1e-10, 1e-11);
    }
  }
}

TEST(MassMatrixTest, ContoursUseFactorsOfThePencil) {
  const Problem plain = Grid(0);
  const Problem weighted = Weighted(plain, MassOf(plain));
  for (const Method method : {Method::kExponentialIntegrator, Method::kLaplaceIteration}) {
    const Options options = AtEnd(method, PropagatorKind::kContour, 50);
    const Solution with = SolveToEnd(weighted, options);
    EXPECT_EQ(with.propagator.used, PropagatorKind::kContour);
    ExpectSame(with, SolveToEnd(plain, options), 1e-9);
  }
}

TEST(MassMatrixTest, ContoursRefuseAMassThatIsNoInnerProduct) {
  const Problem plain = Grid(0);
  SparseMatrix E = MassOf(plain);
  E.coeffRef(0, 1) += 0.1;
  const Solution solution =
      SolveWith(Weighted(plain, E), AtEnd(Method::kExponentialIntegrator, PropagatorKind::kContour, 50));
  EXPECT_EQ(solution.termination, Termination::kUnsupported);
  EXPECT_THAT(solution.message, HasSubstr("E must be symmetric positive definite"));
}

TEST(MassMatrixTest, EveryMethodSolvesWithADenseOne) {
  const Problem plain = AdvectedGrid({.side = 5, .constraints = 3, .speed = 2});
  Matrix E = Matrix(MassOf(plain));
  E.row(3) += 0.5 * E.row(4);  // neither symmetric nor sparse
  E.row(7) *= 1e6;
  for (const Method method : {Method::kExponentialIntegrator, Method::kLaplaceIteration, Method::kTimeStepping,
                              Method::kWuChenIteration, Method::kEventDriven, Method::kAuto}) {
    Options options = AtEnd(method, PropagatorKind::kAuto, 100);
    if (method == Method::kEventDriven) options.num_steps = 0;
    ExpectSame(SolveToEnd(Weighted(plain, E), options), SolveToEnd(Dense(plain), options), 1e-8);
  }
}

TEST(MassMatrixTest, ADiagonalKeepsWhatIsSparse) {
  const Problem plain = Grid(3);
  const Vector diagonal = Vector::LinSpaced(plain.num_states(), 1e-12, 1e3);
  const SparseMatrix E = SparseMatrix(diagonal.asDiagonal());
  const Options options = AtEnd(Method::kAuto, PropagatorKind::kAuto, 60);
  const Solution with = SolveToEnd(Weighted(plain, E), options);
  EXPECT_EQ(with.propagator.used, SolveToEnd(plain, options).propagator.used);
  ExpectSame(with, SolveToEnd(plain, options), 1e-9);
  EXPECT_NE(WithoutMass(Weighted(plain, E)).A.sparse(), nullptr);
}

TEST(MassMatrixTest, TheFormLeftToItselfFollowsSizeAndStructure) {
  const Problem large = Grid(1), small = AdvectedGrid({.side = 5, .constraints = 3});
  const Options options = AtEnd(Method::kAuto, PropagatorKind::kAuto, 20);
  EXPECT_EQ(SolveToEnd(Weighted(large, MassOf(large)), options).propagator.used, PropagatorKind::kSparseStepping);
  EXPECT_EQ(SolveToEnd(Weighted(small, MassOf(small)), options).propagator.used, PropagatorKind::kDense);
}

// Linear elements on a line with ends at zero: sin(πx) decays at the rate of the pencil. No pair acts.
TEST(MassMatrixTest, ElementsOnALineDecayAtTheRateOfThePencil) {
  constexpr Index kPoints = 399;
  const double h = 1.0 / (kPoints + 1);
  std::vector<Eigen::Triplet<double>> stiffness, mass;
  for (Index i = 0; i < kPoints; ++i) {
    stiffness.emplace_back(i, i, -2 / h);
    mass.emplace_back(i, i, 4 * h / 6);
    if (i == 0) continue;
    for (const auto& [row, column] : {std::pair(i, i - 1), {i - 1, i}}) {
      stiffness.emplace_back(row, column, 1 / h);
      mass.emplace_back(row, column, h / 6);
    }
  }
  SparseMatrix A(kPoints, kPoints), E(kPoints, kPoints), B(kPoints, 1), N(1, kPoints);
  A.setFromTriplets(stiffness.begin(), stiffness.end());
  E.setFromTriplets(mass.begin(), mass.end());
  B.insert(kPoints / 2, 0) = 1;
  N.insert(0, kPoints / 2) = 1;
  Problem problem;
  problem.A = StructuredMatrix(A);
  problem.E = StructuredMatrix(E);
  problem.B = StructuredMatrix(B);
  problem.N = StructuredMatrix(N);
  problem.M = Matrix::Ones(1, 1);
  problem.f = TimeFunction::Zero(kPoints);
  problem.g = TimeFunction::Zero(1);
  problem.x0 = (Vector::LinSpaced(kPoints, h, 1 - h) * std::numbers::pi).array().sin();
  problem.horizon = 0.2;
  const double c = std::cos(std::numbers::pi * h);
  const double rate = 6 / (h * h) * (2 - 2 * c) / (4 + 2 * c);
  const Vector exact = std::exp(-rate * problem.horizon) * problem.x0;
  const auto error_of = [&](Method method, PropagatorKind propagator, double tolerance) {
    Options options;
    options.method = method;
    options.propagator = propagator;
    options.error_tolerance = tolerance;
    options.output_times = {problem.horizon};
    options.output_times_only = true;
    return MaxAbs(SolveToEnd(problem, options).x.col(0) - exact) / MaxAbs(exact);
  };
  EXPECT_LE(error_of(Method::kAuto, PropagatorKind::kAuto, 1e-6), 1e-6);
  EXPECT_LE(error_of(Method::kExponentialIntegrator, PropagatorKind::kContour, 1e-6), 1e-10);
}

TEST(MassMatrixTest, SourcesOfEveryKindAreMultiplied) {
  Problem problem;
  problem.A = Matrix{{-1, 0.5}, {0, -2}};
  problem.B = Matrix{{1}, {1}};
  problem.N = Matrix{{1, 0}};
  problem.M = Matrix{{1}};
  problem.g = TimeFunction::Constant(Vector{{-0.2}});
  problem.x0 = Vector{{1, -1}};
  problem.horizon = 2;
  const Matrix E{{2, 1}, {1, 3}};
  const std::vector<TimeFunction> sources = {
      TimeFunction::Constant(Vector{{1, 2}}), TimeFunction::Formulas({"sin(t)", "t*t"}),
      TimeFunction::Sampled({0, 1, 2}, Matrix{{0, 1, 0}, {2, 0, 1}}),
      TimeFunction{
          {{0, ConstantFunction{Vector{{1, 0}}}}, {1, PiecewisePolynomial{{0, 2}, {Matrix{{1, 2}, {0, 1}}}}}}}};
  for (const TimeFunction& f : sources) {
    problem.f = f;
    Problem weighted = problem;
    weighted.E = E;
    weighted.A = E * problem.A.Dense();
    weighted.B = E * problem.B.Dense();
    weighted.f.lift = E;
    const Solution with = testing::SolveForEnd(weighted), without = testing::SolveForEnd(problem);
    EXPECT_LE(MaxAbs(with.x - without.x), 1e-9);
    // Without a lift, the other way round.
    Problem divided = problem;
    divided.E = E;
    const Solution of_E = testing::SolveForEnd(divided);
    Problem by_hand = problem;
    by_hand.A = E.inverse() * problem.A.Dense();
    by_hand.B = E.inverse() * problem.B.Dense();
    by_hand.f.lift = Matrix(E.inverse());
    EXPECT_LE(MaxAbs(of_E.x - testing::SolveForEnd(by_hand).x), 1e-9);
  }
}

TEST(MassMatrixTest, AnInconsistentStateJumpsAlongTheMass) {
  // w = x1 + x2 >= 0 from x = (-1, 0), M = 0: x jumps by E⁻¹ B p, p = 1 / (N E⁻¹ B).
  Problem plain;
  plain.A = -Matrix::Identity(2, 2);
  plain.B = Matrix{{1}, {0}};
  plain.N = Matrix{{1, 1}};
  plain.M = Matrix::Zero(1, 1);
  plain.f = TimeFunction::Zero(2);
  plain.g = TimeFunction::Zero(1);
  plain.x0 = Vector{{-1, 0}};
  plain.horizon = 1;
  plain.E = Matrix{{2, 1}, {1, 2}};
  Options options;
  options.project_initial_state = true;
  options.num_steps = 10;
  const Solution solution = SolveToEnd(plain, options);
  ASSERT_FALSE(solution.jumps.empty());
  // E⁻¹ B = (2, -1)/3, N of it 1/3: p = 3.
  EXPECT_NEAR(solution.jumps[0].dx[0], 2, 1e-12);
  EXPECT_NEAR(solution.jumps[0].dx[1], -1, 1e-12);
}

TEST(MassMatrixTest, AnInconsistentStateJumpsAlsoWhereItIsKept) {
  Problem plain = Grid(0);
  plain.M = StructuredMatrix(SparseMatrix(plain.num_constraints(), plain.num_constraints()));
  plain.x0.setConstant(-1);
  Options options = AtEnd(Method::kTimeStepping, PropagatorKind::kSparseStepping, 60);
  options.project_initial_state = true;
  const Solution with = SolveToEnd(Weighted(plain, MassOf(plain)), options), without = SolveToEnd(plain, options);
  ASSERT_EQ(with.jumps.size(), 1u);
  ASSERT_EQ(without.jumps.size(), 1u);
  EXPECT_LE(MaxAbs(with.jumps[0].dx - without.jumps[0].dx), 1e-11 * MaxAbs(without.jumps[0].dx));
  ExpectSame(with, without, 1e-9);
}

std::string Complaint(const StructuredMatrix& E) {
  Problem problem = AdvectedGrid({.side = 2, .constraints = 1});
  problem.E = E;
  std::string all;
  for (const Violation& violation : Validate(problem)) all += violation.field + ": " + violation.description + "\n";
  return all;
}

TEST(MassMatrixTest, NamesWhatIsSingular) {
  Matrix E = Matrix::Identity(4, 4);
  EXPECT_THAT(Complaint(E), IsEmpty());
  E(2, 2) = 0;
  EXPECT_THAT(Complaint(E), HasSubstr("E: singular, so that E x' does not determine x': row 2 is zero."));
  E(0, 0) = 0;
  EXPECT_THAT(Complaint(StructuredMatrix(SparseMatrix(E.sparseView()))), HasSubstr("rows 0 and 2 are zero."));
  E = Matrix::Identity(4, 4);
  E.row(3) = E.row(1);
  E(1, 0) = E(3, 0) = 2;
  EXPECT_THAT(Complaint(E), HasSubstr("column 3 is zero"));
  E(1, 3) = E(3, 3) = 5;
  EXPECT_THAT(Complaint(E), HasSubstr("rows 1 and 3 depend on each other"));
  E(3, 3) = 5 + 1e-6;
  EXPECT_THAT(Complaint(E), IsEmpty());
  // A chain of three rows that add up to zero; the fourth is none of them.
  EXPECT_THAT(Complaint(Matrix{{1, -1, 0, 0}, {-1, 2, -1, 0}, {0, -1, 1, 0}, {0, 0, 0, 1}}),
              HasSubstr("rows 0, 1 and 2 depend on each other"));
}

TEST(MassMatrixTest, UnitsMakeNothingSingular) {
  EXPECT_THAT(Complaint(Matrix(Vector{{1e-12, 1e6, 1, 1e-300}}.asDiagonal())), IsEmpty());
  const Matrix core{{2, 1, 0, 0}, {1, 2, 1, 0}, {0, 1, 2, 1}, {0, 0, 1, 2}};
  const Vector units{{1e-9, 1, 1e7, 1e-3}};
  EXPECT_THAT(Complaint(Matrix(units.asDiagonal() * core * units.cwiseInverse().asDiagonal())), IsEmpty());
}

TEST(MassMatrixTest, ShapesAndEntriesAreChecked) {
  EXPECT_THAT(Complaint(Matrix::Identity(3, 3)), HasSubstr("E: 3x3; must be m x m = 4x4 (m from A)"));
  EXPECT_THAT(Complaint(Matrix::Ones(4, 1)), HasSubstr("E: 4x1; must be m x m = 4x4"));
  Matrix E = Matrix::Identity(4, 4);
  E(1, 2) = std::nan("");
  EXPECT_THAT(Complaint(E), HasSubstr("E[1][2]"));
}

TEST(MassMatrixTest, TheAnalysisLooksAtTheSystemThatIsSolved) {
  const Problem plain = AdvectedGrid({.side = 5, .constraints = 3});
  const auto with = Analyze(Weighted(plain, MassOf(plain)), {}, {}), without = Analyze(Dense(plain), {}, {});
  ASSERT_TRUE(with.ok() && without.ok());
  ASSERT_EQ(with->sections.size(), without->sections.size());
  for (std::size_t k = 0; k < with->sections.size(); ++k) EXPECT_EQ(with->sections[k].id, without->sections[k].id);
  EXPECT_EQ(with->recommendation.options.method, without->recommendation.options.method);
}

// E of condition 2e13, and A = -2E: x = x0 e^{-2t} whatever E is.
TEST(MassMatrixTest, AnIllConditionedOneDoesNotShowInTheStates) {
  constexpr Index kSize = 10;
  Problem problem;
  Matrix hilbert(kSize, kSize);
  for (Index i = 0; i < kSize; ++i) {
    for (Index j = 0; j < kSize; ++j) hilbert(i, j) = 1.0 / static_cast<double>(i + j + 1);
  }
  problem.E = hilbert;
  problem.A = -2 * hilbert;
  problem.B = Matrix::Zero(kSize, 1);
  problem.N = Matrix::Zero(1, kSize);
  problem.M = Matrix::Identity(1, 1);
  problem.f = TimeFunction::Zero(kSize);
  problem.g = TimeFunction::Constant(Vector::Ones(1));
  problem.x0 = Vector::LinSpaced(kSize, 1, kSize);
  problem.horizon = 2;
  const Solution solution = SolveToEnd(problem, {});
  const Vector end = solution.x.rightCols(1);
  EXPECT_LT(MaxAbs((end.cwiseQuotient(problem.x0) * std::exp(4)).array() - 1), 1e-12);
}

}  // namespace
}  // namespace dlcs
