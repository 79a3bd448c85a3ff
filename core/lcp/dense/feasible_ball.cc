// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/feasible_ball.h"

#include <cmath>

#include "core/linalg/linear_program.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// max t subject to  q + M y >= t e, 0 <= y <= `upper`; y of the optimum, clipped to y >= 0, or nothing.
std::optional<Vector> LiftLowestComponent(const Vector& q, const Matrix& M, double upper) {
  const Index n = M.rows();
  LinearProgram program = MakeLinearProgram(n, n + 1);
  program.rows.leftCols(n) = M;
  program.rows.col(n).setConstant(-1);
  program.row_lower = -q;
  program.upper.head(n).setConstant(upper);
  program.lower[n] = -kUnbounded;
  program.cost[n] = -1;
  const LinearProgramSolution solution = SolveLinearProgram(program);
  if (solution.verdict != LinearProgramVerdict::kOptimal) return std::nullopt;
  return solution.z.head(n).cwiseMax(0);
}

}  // namespace

FeasibleBall LargestFeasibleBall(const Vector& q0, const Matrix& M) {
  const double size_of_M = MaxAbs(M);
  if (size_of_M == 0) return {q0.minCoeff(), Vector::Zero(q0.size())};
  const Matrix scaled = M / size_of_M;
  const auto direction = LiftLowestComponent(Vector::Zero(q0.size()), scaled, 1);
  if (direction && (scaled * *direction).minCoeff() > kProgramMargin) return {HUGE_VAL, *direction};

  // Scaling q0 scales ρ and y with it.
  const double size_of_q = MaxAbs(q0) > 0 ? MaxAbs(q0) : 1;
  const auto lifted = LiftLowestComponent(q0 / size_of_q, scaled, kUnbounded);
  if (!lifted) return {};
  const Vector y = *lifted * (size_of_q / size_of_M);
  return {(q0 + M * y).minCoeff(), y};
}

double FeasibleStateRadius(double radius, double drift, const StructuredMatrix& N) {
  if (radius < drift) return 0;
  const double norm = InfinityNorm(N);
  return norm == 0 ? HUGE_VAL : (radius - drift) / norm;
}

}  // namespace dlcs
