// SPDX-License-Identifier: Apache-2.0
#include "tests/support/lcp_linear_program.h"

#include "core/linalg/linear_program.h"

namespace dlcs::testing {

namespace {

// argmin { Σ y_i : 0 <= y <= y_upper, lower <= M y <= upper }.
std::optional<Vector> MinimizeSum(const Matrix& M, const Vector& y_upper, const Vector& lower, const Vector& upper) {
  LinearProgram program = MakeLinearProgram(M.rows(), M.cols());
  program.cost.setOnes();
  program.rows = M;
  program.row_lower = lower;
  program.row_upper = upper;
  program.upper = y_upper;
  const LinearProgramSolution solution = SolveLinearProgram(program);
  if (solution.verdict == LinearProgramVerdict::kInfeasible) return std::nullopt;
  return solution.z;
}

}  // namespace

std::optional<Vector> MinimizeSumOverFeasible(const Matrix& M, const Vector& q) {
  const Vector infinity = Vector::Constant(q.size(), kUnbounded);
  return MinimizeSum(M, infinity, -q, infinity);
}

bool HasSolutionByEnumeration(const Matrix& M, const Vector& q) {
  const Index n = q.size();
  for (unsigned subset = 0; subset < (1u << n); ++subset) {
    Vector y_upper = Vector::Zero(n);
    Vector w_upper = Vector::Constant(n, kUnbounded);
    for (Index i = 0; i < n; ++i) {
      if ((subset >> i & 1u) == 0) continue;
      y_upper[i] = kUnbounded;
      w_upper[i] = -q[i];
    }
    if (MinimizeSum(M, y_upper, -q, w_upper).has_value()) return true;
  }
  return false;
}

}  // namespace dlcs::testing
