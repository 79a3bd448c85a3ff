// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis/solution_function.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/lcp/basis/tolerance.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/equilibration.h"
#include "core/linalg/linear_program.h"
#include "core/linalg/panel_lu.h"

namespace dlcs {
namespace {

// The factors of M_JJ in units in which its entries are of size one.
struct Block {
  Block(const Matrix& M, const std::vector<Index>& J)
      : scale(SymmetricEquilibration(M(J, J))), lu(scale.asDiagonal() * M(J, J) * scale.asDiagonal()) {}

  // Returns whether M_JJ is singular to working precision, whatever the units.
  bool singular() const { return !(lu.ReciprocalCondition() > RoundingOf(2 * scale.size())); }
  Matrix Inverse() const { return scale.asDiagonal() * lu.Solve(Matrix(scale.asDiagonal())); }

  Vector scale;
  PanelLu lu;
};

}  // namespace

IndexSets FindIndexSets(const Matrix& M, const Vector& q, const Vector& y) {
  const BoundedSums<Vector> w = BoundedProduct(M, y, q);
  const Vector zero = kWorkingPrecision * w.terms;
  IndexSets sets;
  for (Index i = 0; i < y.size(); ++i) {
    const bool matters = ((M.col(i).cwiseAbs() * y[i]).array() > zero.array()).any();
    const bool free = (M.col(i).array() == 0).all();  // no w depends on y_i: any positive value counts
    if (y[i] > 0 && (matters || free)) {
      sets.J.push_back(i);
    } else if (w.value[i] > zero[i]) {
      sets.I.push_back(i);
    } else {
      sets.K.push_back(i);
    }
  }
  return sets;
}

std::optional<Matrix> ClarkeElement(const Matrix& M, const std::vector<Index>& J) {
  const Index n = M.rows();
  Matrix element = Matrix::Zero(n, n);
  if (J.empty()) return element;
  const Block block(M, J);
  if (block.singular()) return std::nullopt;
  element(J, J) = -block.Inverse();
  return element;
}

Fact TestDifferentiable(const Matrix& M, const IndexSets& sets) {
  Fact fact;
  if (sets.degenerate()) {
    fact = {Answer::kNo, absl::StrCat("degenerate: y[", sets.K[0], "] = w[", sets.K[0], "] = 0")};
    fact.witness.indices = sets.K;
    return fact;
  }
  fact.witness.indices = sets.J;
  const bool nonsingular = sets.J.empty() || !Block(M, sets.J).singular();
  fact.answer = nonsingular ? Answer::kYes : Answer::kNo;
  fact.why = nonsingular ? "nondegenerate, and M_JJ is nonsingular" : "M_JJ is singular";
  return fact;
}

// A row that cannot be positive, or else the largest ρ <= 1 with v >= ρ and q + M v >= ρ, in the units of a
// scaled problem.
Fact TestInteriorPoint(const Matrix& M, const Vector& q) {
  const Index n = M.rows();
  for (Index i = 0; i < n; ++i) {
    if (q[i] <= 0 && (M.row(i).array() <= 0).all()) {
      return {Answer::kNo, absl::StrCat("w[", i, "] = q[", i, "] + (M v)[", i, "] <= 0 for all v >= 0")};
    }
  }
  const double size = std::max(1.0, q.lpNorm<Eigen::Infinity>());
  LinearProgram program = MakeLinearProgram(2 * n, n + 1);
  program.rows.topLeftCorner(n, n) = M;
  program.rows.bottomLeftCorner(n, n).setIdentity();
  program.rows.col(n).setConstant(-1);
  program.row_lower.head(n) = -q / size;
  program.row_lower.tail(n).setZero();
  program.lower[n] = -1;
  program.upper[n] = 1;
  program.cost[n] = -1;
  const LinearProgramSolution solution = SolveLinearProgram(program);
  if (solution.verdict == LinearProgramVerdict::kInfeasible) {
    return {Answer::kNo, "no v >= 0 has q + M v >= 0, not even nearly"};
  }
  if (solution.verdict != LinearProgramVerdict::kOptimal) return {Answer::kUnknown, "the linear program failed"};
  const Vector v = size * solution.z.head(n);
  const double margin = std::min(v.minCoeff(), (q + M * v).minCoeff());
  if (margin <= kProgramMargin * size) {
    const bool outside = solution.z[n] < -kProgramMargin;
    return {outside ? Answer::kNo : Answer::kUnknown,
            outside ? "no v >= 0 has q + M v >= 0"
                    : "the largest margin min(v, q + M v) is zero to the tolerance of the linear program: "
                      "there is no "
                      "interior point, or a very flat one"};
  }
  Fact fact{Answer::kYes, absl::StrCat("some v > 0 has q + M v > 0, both by ", margin)};
  fact.witness.z = v;
  fact.witness.value = margin;
  return fact;
}

}  // namespace dlcs
