// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/linear_program.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <bit>
#include <optional>
#include <vector>

#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

TEST(LinearProgramTest, TellsInfeasibleFromUnbounded) {
  LinearProgram program = MakeLinearProgram(1, 2);
  program.rows << 1, 1;
  program.row_upper << -1;  // x + y <= -1, x, y >= 0
  EXPECT_EQ(SolveLinearProgram(program).verdict, LinearProgramVerdict::kInfeasible);
  program.row_upper << kUnbounded;
  program.cost << -1, 0;
  EXPECT_EQ(SolveLinearProgram(program).verdict, LinearProgramVerdict::kUnboundedBelow);
}

// x, y >= 1 and x + y <= 2 - δ: rounding of numbers of size one makes a program infeasible only beyond nine digits.
TEST(LinearProgramTest, NumbersThatAgreeToNineDigitsDoNotContradict) {
  const auto verdict = [](double gap) {
    LinearProgram program = MakeLinearProgram(1, 2);
    program.rows << 1, 1;
    program.row_upper << 2 - gap;
    program.lower.setOnes();
    program.cost << 1, 1;
    return SolveLinearProgram(program).verdict;
  };
  EXPECT_EQ(verdict(0.5e-9), LinearProgramVerdict::kOptimal);
  EXPECT_EQ(verdict(3e-9), LinearProgramVerdict::kInfeasible);
}

// min x + 2y over x + y >= 3, x - y = 1 with free x and y is taken at (2, 1): cost = 3/2 (1, 1) - 1/2 (1, -1).
TEST(LinearProgramTest, TakesFreeVariablesAndEqualities) {
  LinearProgram program = MakeLinearProgram(2, 2);
  program.rows << 1, 1, 1, -1;
  program.row_lower << 3, 1;
  program.row_upper << kUnbounded, 1;
  program.lower.setConstant(-kUnbounded);
  program.cost << 1, 2;
  const LinearProgramSolution solution = SolveLinearProgram(program);
  ASSERT_EQ(solution.verdict, LinearProgramVerdict::kOptimal);
  EXPECT_NEAR(solution.z[0], 2, 1e-9);
  EXPECT_NEAR(solution.z[1], 1, 1e-9);
  EXPECT_NEAR(solution.objective, 4, 1e-9);
  EXPECT_NEAR(solution.row_duals[0], 1.5, 1e-9);
  EXPECT_NEAR(solution.row_duals[1], -0.5, 1e-9);
}

// The least value of costᵀz over the vertices of { Az >= b, z >= 0 }; n tight ones among the m + n
// inequalities.
std::optional<double> LeastVertex(const Matrix& A, const Vector& b, const Vector& cost) {
  const Index m = A.rows(), n = A.cols();
  Matrix all(m + n, n);
  all << A, Matrix::Identity(n, n);
  Vector limits = Vector::Zero(m + n);
  limits.head(m) = b;
  std::optional<double> least;
  for (unsigned set = 0; set < 1u << (m + n); ++set) {
    if (std::popcount(set) != n) continue;
    std::vector<Index> tight;
    for (Index i = 0; i < m + n; ++i) {
      if (set >> i & 1u) tight.push_back(i);
    }
    const Eigen::FullPivLU<Matrix> lu(Matrix(all(tight, Eigen::all)));
    if (!lu.isInvertible()) continue;
    const Vector z = lu.solve(Vector(limits(tight)));
    if ((all * z - limits).minCoeff() < -1e-9) continue;
    const double value = cost.dot(z);
    if (!least || value < *least) least = value;
  }
  return least;
}

// Costs are positive, so that a program is infeasible or has an optimal vertex.
TEST(LinearProgramTest, FindsTheBestVertex) {
  LcpGenerator generator(41);
  int optimal = 0, infeasible = 0;
  for (int k = 0; k < 200; ++k) {
    const Index n = generator.Integer(1, 4), m = generator.Integer(1, 4);
    LinearProgram program = MakeLinearProgram(m, n);
    program.rows = generator.Gaussian(m, n);
    for (Index i = 0; i < m; ++i) program.row_lower[i] = generator.Uniform(-1, 1);
    for (Index j = 0; j < n; ++j) program.cost[j] = generator.Uniform(0.1, 1);
    const LinearProgramSolution solution = SolveLinearProgram(program);
    const std::optional<double> least = LeastVertex(program.rows, program.row_lower, program.cost);
    ASSERT_EQ(solution.verdict, least ? LinearProgramVerdict::kOptimal : LinearProgramVerdict::kInfeasible);
    ++(least ? optimal : infeasible);
    if (!least) continue;
    EXPECT_NEAR(solution.objective, *least, 1e-7);
    EXPECT_NEAR(program.row_lower.dot(solution.row_duals), *least, 1e-7);  // duality
    EXPECT_GE(solution.row_duals.minCoeff(), -1e-9);
    EXPECT_GE((program.rows * solution.z - program.row_lower).minCoeff(), -1e-8);
  }
  EXPECT_GT(optimal, 50);
  EXPECT_GT(infeasible, 20);
}

}  // namespace
}  // namespace dlcs
