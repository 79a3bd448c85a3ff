// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/s_matrix.h"

#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/linear_program.h"
#include "core/matrix_classes/exact_classes.h"
#include "core/matrix_classes/m_matrix.h"

namespace dlcs {
namespace {

constexpr Index kMaxLinearProgramRows = 200;

// Entries that are zero in every term count as zero; others must be negative beyond rounding.
bool ImageIsNotPositive(const Matrix& M, const Vector& z) {
  const BoundedSums<Vector> image = BoundedProduct(M, z);
  return z.minCoeff() >= 0 && z.maxCoeff() > 0 &&
         (image.value.array() <= -RoundingOfProduct(M.cols()) * image.terms.array()).all();
}

Fact WithWitness(Answer answer, std::string why, Vector z) {
  Fact fact{answer, std::move(why)};
  fact.witness.z = std::move(z);
  return fact;
}

Fact Yes(Vector z) { return WithWitness(Answer::kYes, "some z >= 0 has Mz > 0", std::move(z)); }

// max t subject to Mz >= te, z >= 0, Σz = 1.
Fact ByGame(const Matrix& M) {
  const Index n = M.rows();
  LinearProgram program = MakeLinearProgram(n + 1, n + 1);
  program.rows.topLeftCorner(n, n) = M;
  program.rows.col(n).head(n).setConstant(-1);
  program.row_lower.head(n).setZero();
  program.rows.row(n).head(n).setOnes();
  program.row_lower[n] = program.row_upper[n] = 1;
  program.lower[n] = -kUnbounded;
  program.cost[n] = -1;
  const LinearProgramSolution game = SolveLinearProgram(program);
  if (game.verdict != LinearProgramVerdict::kOptimal) return {Answer::kUnknown, "the linear program failed"};
  if (Vector z = game.z.head(n).cwiseMax(0); ImageIsPositive(M, z)) return Yes(std::move(z));
  if (Vector y = game.row_duals.head(n).cwiseAbs(); ImageIsNotPositive(M.transpose(), y)) {
    return WithWitness(Answer::kNo, "some z >= 0, z != 0, has Mᵀz <= 0", std::move(y));
  }
  if (const Fact exact = ExactlyS(M); exact.answer != Answer::kUnknown) return exact;
  return {Answer::kUnknown,
          absl::StrCat("the value of the game max_z min_i (Mz)_i is ", -game.objective, ", zero to working precision")};
}

}  // namespace

bool ImageIsPositive(const Matrix& M, const Vector& z) {
  return z.minCoeff() >= 0 && BoundedProduct(M, z).AllPositive(RoundingOfProduct(M.cols()));
}

Matrix ZMatrixBelow(const Matrix& M) {
  Matrix below = M.cwiseMin(0);
  below.diagonal() = M.diagonal();
  return below;
}

Vector PositiveImageOfMMatrix(const Matrix& Z) {
  std::vector<Index> all(static_cast<std::size_t>(Z.rows()));
  std::iota(all.begin(), all.end(), Index{0});
  MMatrixFactor factor(Z);
  if (factor.Factor(Z, all) < Z.rows()) return {};
  Vector z = Vector::Ones(Z.rows());
  factor.Solve(z);
  return z.minCoeff() > 0 && ImageIsPositive(Z, z) ? z : Vector();
}

Fact TestSMatrix(const Matrix& M) {
  const Index n = M.rows();
  if (Vector z = Vector::Ones(n); ImageIsPositive(M, z)) return Yes(std::move(z));
  for (Index i = 0; i < n; ++i) {
    if (M.row(i).maxCoeff() > 0) continue;
    return WithWitness(Answer::kNo, absl::StrCat("row ", i, " has no positive entry"), Vector::Unit(n, i));
  }
  if (Vector z = PositiveImageOfMMatrix(ComparisonMatrix(M)); z.size() == n && ImageIsPositive(M, z)) {
    return Yes(std::move(z));
  }
  if (n <= kMaxLinearProgramRows) return ByGame(M);
  return {Answer::kUnknown, absl::StrCat("n = ", n, " is beyond the linear program (n <= ", kMaxLinearProgramRows,
                                         ") and no other z is known")};
}

Fact TestMMatrix(const Fact& z, const Fact& s) {
  if (!z.yes()) return z;
  Fact fact = s;
  fact.why = absl::StrCat("a Z-matrix, and ", s.why);
  return fact;
}

}  // namespace dlcs
