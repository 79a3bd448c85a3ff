// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/relative_degree.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <optional>
#include <string>

#include "core/analyze.h"
#include "core/linalg/norms.h"
#include "tests/support/lcp_problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

TEST(RelativeDegreeTest, CountsTheIntegratorsOfAChain) {
  for (const int length : {1, 2, 3, 8, 40}) {
    Matrix A = Matrix::Zero(length, length);
    for (int i = 0; i + 1 < length; ++i) A(i, i + 1) = 1e6;
    Matrix B = Matrix::Zero(length, 1);
    B(length - 1, 0) = 1e-9;
    Matrix N = Matrix::Zero(1, length);
    N(0, 0) = 1e-9;
    EXPECT_EQ(RelativeDegree(A, B, N), length);
  }
}

TEST(RelativeDegreeTest, IsAbsentWhereYNeverActsOnW) {
  EXPECT_EQ(RelativeDegree(Matrix::Zero(1, 1), Matrix::Zero(1, 1), Matrix::Zero(1, 1)), std::nullopt);
  const Matrix A{{-1, 0}, {5, -2}};
  EXPECT_EQ(RelativeDegree(A, Vector{{0.0, 1}}, Vector{{1.0, 0}}.transpose()), std::nullopt);
  EXPECT_EQ(RelativeDegree(A, Vector{{1.0, 0}}, Vector{{0.0, 1}}.transpose()), 2);
}

// In other coordinates the zeros are sums that cancel to rounding.
TEST(RelativeDegreeTest, DoesNotMistakeRoundingForAnAction) {
  testing::LcpGenerator generator(1);
  Matrix A = Matrix::Zero(6, 6);
  for (int i = 0; i < 5; ++i) A(i, i + 1) = 1;
  A.row(5).setConstant(-0.5);
  const Matrix B = Matrix::Identity(6, 6).rightCols(1);
  const Matrix N = Matrix::Identity(6, 6).topRows(1);
  for (int k = 0; k < 20; ++k) {
    const Matrix T = generator.PositiveDefinite(6) + Matrix::Identity(6, 6);
    const Matrix inverse = T.inverse();
    EXPECT_EQ(RelativeDegree(T * A * inverse, T * B, N * inverse), 6);
  }
}

TEST(RelativeDegreeTest, IsOneAsSoonAsSomeEntryActs) {
  const Matrix A = Matrix::Zero(2, 2);
  EXPECT_EQ(RelativeDegree(A, Matrix::Identity(2, 2), Matrix{{0, 0}, {0, 1e-12}}), 1);
}

// Chains of 1, 2 and 4 integrators, one that y does not reach, and a row of M that is not zero; in any coordinates.
TEST(RelativeDegreeTest, GivesEveryRowItsOwnDegree) {
  constexpr Index m = 8, n = 5;
  Matrix A = Matrix::Zero(m, m), B = Matrix::Zero(m, n), N = Matrix::Zero(n, m), M = Matrix::Zero(n, n);
  B(0, 0) = N(0, 0) = 1;
  A(1, 2) = B(2, 1) = N(1, 1) = 1;
  A(3, 4) = A(4, 5) = A(5, 6) = B(6, 2) = N(2, 3) = 1;
  A(7, 7) = -1;
  N(3, 7) = N(4, 1) = M(4, 4) = 1;
  testing::LcpGenerator generator(2);
  for (int k = 0; k < 10; ++k) {
    const Matrix T = k == 0 ? Matrix(Matrix::Identity(m, m)) : generator.PositiveDefinite(m) + Matrix::Identity(m, m);
    const Matrix inverse = T.inverse();
    const auto degrees = RelativeDegrees(T * A * inverse, T * B, N * inverse, M);
    ASSERT_EQ(degrees.size(), 5u);
    EXPECT_EQ(degrees[0], 1);
    EXPECT_EQ(degrees[1], 2);
    EXPECT_EQ(degrees[2], 4);
    EXPECT_EQ(degrees[4], 0);
    if (k == 0) {
      EXPECT_EQ(degrees[3], std::nullopt);
    }
    const std::vector<Index> rows = ImpulsiveRows({degrees[0], degrees[1], degrees[2], std::nullopt, degrees[4]});
    EXPECT_EQ(rows, (std::vector<Index>{1, 2}));
    EXPECT_EQ(DescribeRows(rows, degrees), "constraints 1 (relative degree 2), 2 (relative degree 4)");
  }
}

// A reflected drift x1' = y1 - 1 over 0, beside a mass that falls on the floor at t = √(2/9.81) = 0.45: rows 0 and 1 of
// w have degrees 1 and 2. `M` of the first row is 0, or a spring.
Problem DriftAndFallingMass(double M, double horizon) {
  Problem problem;
  problem.A = Matrix::Zero(3, 3);
  problem.A(1, 2) = 1;
  problem.B = Matrix::Zero(3, 2);
  problem.B(0, 0) = problem.B(2, 1) = 1;
  problem.N = Matrix::Identity(2, 3);
  problem.M = Matrix::Zero(2, 2);
  problem.M(0, 0) = M;
  problem.f = TimeFunction::Constant(Vector{{-1, 0, -9.81}});
  problem.g = TimeFunction::Zero(2);
  problem.x0 = Vector{{0, 1, 0}};
  problem.horizon = horizon;
  return problem;
}

Solution Solved(const Problem& problem, Index steps) {
  Options options;
  options.num_steps = steps;
  return testing::SolveWith(problem, options);
}

bool Tells(const std::vector<std::string>& warnings, const std::string& what) {
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const std::string& warning) { return warning.find(what) != std::string::npos; });
}

TEST(RelativeDegreeTest, OneRowOfDegreeTwoIsServedUntilItActs) {
  for (const double M : {0.0, 1.0}) {
    const Solution before = Solved(DriftAndFallingMass(M, 0.4), 400);
    ASSERT_EQ(before.termination, Termination::kReachedEnd) << before.message;
    EXPECT_TRUE(Tells(before.warnings, "constraint 1 (relative degree 2)"));
    EXPECT_FALSE(Tells(before.warnings, "y > 0"));
    EXPECT_NEAR(before.x(1, 400), 1 - 9.81 * 0.08, 1e-12);
    EXPECT_GT(before.y(0, 400), 0.1);

    double last = 0;
    for (const Index steps : {400, 1600, 6400}) {
      const Solution behind = Solved(DriftAndFallingMass(M, 0.5), steps);
      ASSERT_EQ(behind.termination, Termination::kReachedEnd) << behind.message;
      EXPECT_TRUE(Tells(behind.warnings, "y > 0 at t = 0.45")) << behind.warnings.back();
      EXPECT_GT(MaxAbs(behind.y.row(1)), 2 * last) << "an impulse: y grows like 1/h";
      last = MaxAbs(behind.y.row(1));
    }
  }
}

TEST(RelativeDegreeTest, AnalysisNamesTheRow) {
  for (const double M : {0.0, 1.0}) {
    Options options;
    options.num_steps = 100;
    const auto analysis = Analyze(DriftAndFallingMass(M, 0.4), options, {});
    ASSERT_TRUE(analysis.ok());
    EXPECT_TRUE(Tells(analysis->warnings, "y affects constraint 1 (relative degree 2)"));
    const auto section = std::find_if(analysis->sections.begin(), analysis->sections.end(),
                                      [](const AnalysisSection& s) { return s.id == "relative-degree"; });
    ASSERT_NE(section, analysis->sections.end());
    EXPECT_TRUE(section->findings.at(0).fact.no());
    EXPECT_EQ(section->findings[0].fact.witness.indices, (std::vector<Index>{1}));
  }
}

TEST(RelativeDegreeTest, RefusalNamesTheRowsOfASystemWithoutDegreeOne) {
  Problem problem = DriftAndFallingMass(0, 1);
  problem.B(0, 0) = 0;
  problem.B(1, 0) = 0;
  problem.A(0, 2) = 1;  // x1 is driven by the velocity as well: degree two
  const Solution refused = Solved(problem, 10);
  EXPECT_EQ(refused.termination, Termination::kUnsupported);
  EXPECT_NE(refused.message.find("constraints 0 (relative degree 2), 1 (relative degree 2)"), std::string::npos)
      << refused.message;
}

}  // namespace
}  // namespace dlcs
