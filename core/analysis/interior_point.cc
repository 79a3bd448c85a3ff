// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/interior_point.h"

#include <limits>
#include <string>

#include "core/format_number.h"
#include "core/lcp/dense/feasible_ball.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/linear_program.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

bool IsInterior(const Vector& q, const Matrix& M, const Vector& v) {
  return (v.array() > 0).all() && BoundedProduct(M, v, q).AllPositive(RoundingOfProduct(v.size()));
}

// v > 0 from y >= 0 of the ball, moved inwards by half of its margin; where every q is feasible, y is a direction.
Vector PointInside(const FeasibleBall& ball, const Vector& q, const Matrix& M) {
  Vector v = ball.y;
  if (*ball.radius == std::numeric_limits<double>::infinity()) v *= 1 + 2 * MaxAbs(q) / (M * ball.y).minCoeff();
  const double norm = InfinityNorm(M);
  v.array() += norm > 0 ? (q + M * v).minCoeff() / (2 * norm) : 1;
  return v;
}

// min t subject to uᵀq <= t, Mᵀu <= t e, Σu = 1, u >= 0, q and M scaled: t < 0 excludes strictly. Empty if none.
Vector Excluder(const Vector& q, const Matrix& M) {
  const Index n = q.size();
  const auto scaled = [](const auto& values) { return (values / (MaxAbs(values) > 0 ? MaxAbs(values) : 1)).eval(); };
  LinearProgram program = MakeLinearProgram(n + 2, n + 1);
  program.rows.topLeftCorner(n, n) = scaled(M).transpose();
  program.rows.row(n).head(n) = scaled(q).transpose();
  program.rows.col(n).head(n + 1).setConstant(-1);
  program.row_upper.head(n + 1).setZero();
  program.rows.row(n + 1).head(n).setOnes();
  program.row_lower[n + 1] = program.row_upper[n + 1] = 1;
  program.lower[n] = -kUnbounded;
  program.cost[n] = 1;
  const LinearProgramSolution solution = SolveLinearProgram(program);
  if (solution.verdict != LinearProgramVerdict::kOptimal) return {};
  return solution.z.head(n).unaryExpr([](double u) { return u > kProgramTolerance ? u : 0.0; });
}

bool Excludes(const Vector& u, const Vector& q, const Matrix& M) {
  if (u.size() == 0 || !(u.maxCoeff() > 0)) return false;
  const double rounding = RoundingOfProduct(u.size());
  if (u.dot(q) > rounding * u.dot(q.cwiseAbs())) return false;
  const BoundedSums<Vector> sums = BoundedProduct(Matrix(M.transpose()), u);
  return !(sums.value.array() > rounding * sums.terms.array()).any();
}

}  // namespace

Fact TestInteriorPoint(const Vector& q, const Matrix& M) {
  if (q.size() > kMaxInteriorPoint) {
    return {Answer::kUnknown, "n = " + std::to_string(q.size()) + " is beyond the linear program (" +
                                  std::to_string(kMaxInteriorPoint) + ")"};
  }
  const FeasibleBall ball = LargestFeasibleBall(q, M);
  if (!ball.radius) return {Answer::kUnknown, "the linear program failed"};
  Fact fact;
  if (*ball.radius > 0) {
    fact.witness.z = PointInside(ball, q, M);
    if (IsInterior(q, M, fact.witness.z)) {
      fact.answer = Answer::kYes;
      fact.why = "a v > 0 leaves a margin of " + FormatNumber((q + M * fact.witness.z).minCoeff());
      return fact;
    }
  }
  fact.witness.z = Excluder(q, M);
  if (Excludes(fact.witness.z, q, M)) {
    fact.answer = Answer::kNo;
    fact.why = "a weighted sum of the rows is never positive";
    return fact;
  }
  return {Answer::kUnknown, "the largest margin is zero to working precision"};
}

}  // namespace dlcs
