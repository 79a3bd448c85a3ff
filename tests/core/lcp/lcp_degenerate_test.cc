// SPDX-License-Identifier: Apache-2.0
// Problems with small integers, where every kind of degeneracy is common: zero and singular blocks, ties in
// every ratio test, y and w zero together, right-hand sides on the border of solvability. Verdicts are
// compared with linear programs over all sets of active constraints.

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "core/lcp/lcp.h"
#include "tests/support/lcp_linear_program.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

using testing::LcpGenerator;

Matrix Integers(LcpGenerator& generator, Index rows, Index columns) {
  Matrix result(rows, columns);
  for (Index j = 0; j < columns; ++j) {
    for (Index i = 0; i < rows; ++i) result(i, j) = static_cast<double>(generator.Integer(-2, 2));
  }
  return result;
}

Matrix IntegersOfKind(LcpGenerator& generator, Index n, int kind) {
  const Matrix G = Integers(generator, n, n);
  switch (kind) {
    case 0:
      return G;
    case 1:
      return G - G.transpose();
    case 2: {
      const Matrix H = Integers(generator, n, (n + 1) / 2);
      return H * H.transpose() + G - G.transpose();
    }
    case 3: {
      Matrix M = -G.cwiseAbs();
      M.diagonal() = G.diagonal();
      return M;
    }
    case 4: {  // singular M-matrix
      Matrix M = -G.cwiseAbs();
      M.diagonal().setZero();
      M.diagonal() = -M.rowwise().sum();
      return M;
    }
    default:
      return Matrix::Zero(n, n);
  }
}

// Rounding as problems have it that were computed, not typed. Zeros stay: beside nothing else 1e-17 is a number.
Vector Perturbed(LcpGenerator& generator, const Vector& q) {
  return q + 1e-16 * generator.GaussianVector(q.size()).cwiseProduct(q);
}

TEST(DegenerateLcpTest, EveryVerdictIsTrue) {
  LcpGenerator generator(1);
  int solved = 0;
  int infeasible = 0;
  for (int k = 0; k < 6000; ++k) {
    const Index n = generator.Integer(1, 5);
    const Matrix M = IntegersOfKind(generator, n, k % 6);
    const Vector q = Integers(generator, n, 1);
    const bool solvable = testing::HasSolutionByEnumeration(M, q);
    const Vector asked = k % 2 == 0 ? q : Perturbed(generator, q);
    const absl::StatusOr<LcpResult> result = SolveLcp(M, asked, SolutionRule::kAuto);
    ASSERT_TRUE(result.ok());
    ASSERT_EQ(result->verdict, solvable ? LcpStatus::kSolved : LcpStatus::kInfeasible)
        << result->message << "\nM =\n"
        << M << "\nq = " << q.transpose();
    if (solvable) {
      EXPECT_LE(LcpResidual(M, asked, result->y), 1e-13) << M << "\nq = " << q.transpose();
    }
    ++(solvable ? solved : infeasible);
  }
  EXPECT_GT(solved, 1000);
  EXPECT_GT(infeasible, 1000);
}

TEST(DegenerateLcpTest, EveryLeastElementIsTheLeast) {
  LcpGenerator generator(2);
  for (int k = 0; k < 4000; ++k) {
    const Index n = generator.Integer(1, 8);
    const Matrix M = IntegersOfKind(generator, n, 3 + k % 2);
    const Vector q = Integers(generator, n, 1);
    const Vector asked = k % 4 < 2 ? q : Perturbed(generator, q);
    const std::optional<Vector> least = testing::MinimizeSumOverFeasible(M, q);
    const absl::StatusOr<LcpResult> result = SolveLcp(M, asked, SolutionRule::kLeastElement);
    ASSERT_TRUE(result.ok());
    ASSERT_EQ(result->verdict, least.has_value() ? LcpStatus::kSolved : LcpStatus::kInfeasible)
        << result->message << "\nM =\n"
        << M << "\nq = " << q.transpose();
    if (least.has_value()) {
      EXPECT_LE((result->y - *least).lpNorm<Eigen::Infinity>(), 1e-8);
    }
  }
}

// LCP(q, M + K) with K of any size and any sign: solvable exactly when the linear programs say so, whatever M
// was.
TEST(DegenerateLcpTest, CoupledStepsFindASolutionWhereThereIsOne) {
  LcpGenerator generator(3);
  for (int k = 0; k < 6000; ++k) {
    const Index n = generator.Integer(1, 4);
    const Matrix M = IntegersOfKind(generator, n, k % 6);
    const Matrix K = Integers(generator, n, n) / (k % 3 == 0 ? 1.0 : 64.0);
    const Vector q = Integers(generator, n, 1);
    const Selection selection = *SelectRule(SolutionRule::kAuto, Classify(M));
    const std::unique_ptr<LcpSolver> solver = MakeCoupledLcpSolver(M, K, selection);
    Basis basis(n);
    for (std::uint8_t& entry : basis) entry = static_cast<std::uint8_t>(generator.Integer(0, 1));
    Vector y(n);
    const LcpStatus verdict = solver->Solve(q, Vector::Constant(q.size(), 1e-14), basis, y);
    const bool solvable = testing::HasSolutionByEnumeration(M + K, q);
    ASSERT_EQ(verdict, solvable ? LcpStatus::kSolved : LcpStatus::kInfeasible) << solver->Account().message << "\nM =\n"
                                                                               << M << "\nK =\n"
                                                                               << K << "\nq = " << q.transpose();
    if (solvable) {
      const double norm = (M + K).cwiseAbs().rowwise().sum().maxCoeff();
      EXPECT_LE(LcpResidual(M + K, q, y), 1e-13 + 1e-12 * (2 + norm * y.maxCoeff()));
    }
  }
}

}  // namespace
}  // namespace dlcs
