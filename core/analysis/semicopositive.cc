// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/semicopositive.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/analysis/equilibration.h"
#include "core/analysis/p_matrix.h"
#include "core/analysis/principal_minors.h"
#include "core/linalg/linear_program.h"

namespace dlcs {
namespace {

// CLP meets its rows to 1e-9; what is this far from zero has the sign that it shows.
constexpr double kClear = 1e-7;

bool IsNonnegativeWithPositiveDiagonal(const Matrix& M) {
  return M.minCoeff() >= 0 && M.diagonal().minCoeff() > 0;
}

// min over z >= 0, Σz = 1 of max_i (Mz)_i; the variables are z and the value, which is free.
LinearProgramSolution LeastLargestImage(const Matrix& M) {
  const Index n = M.rows();
  LinearProgram program = MakeLinearProgram(n + 1, n + 1);
  program.rows.topLeftCorner(n, n) = M;
  program.rows.col(n).head(n).setConstant(-1);
  program.row_upper.head(n).setZero();
  program.rows.row(n).head(n).setOnes();
  program.row_lower[n] = program.row_upper[n] = 1;
  program.lower[n] = -kUnbounded;
  program.cost[n] = 1;
  return SolveLinearProgram(program);
}

Fact DecideByGames(const Matrix& M) {
  const Vector scale = SymmetricEquilibration(M);
  const Matrix scaled = scale.asDiagonal() * M * scale.asDiagonal();
  bool clear = true;
  for (std::uint32_t subset = 1; subset < (1u << M.rows()); ++subset) {
    const std::vector<Index> indices = IndicesOf(subset);
    const Index size = static_cast<Index>(indices.size());
    const LinearProgramSolution game = LeastLargestImage(scaled(indices, indices));
    if (game.verdict != LinearProgramVerdict::kOptimal || std::abs(game.objective) <= kClear) {
      clear = false;
      continue;
    }
    if (game.objective > 0) continue;
    const Vector z = scale(indices).cwiseProduct(game.z.head(size).cwiseMax(0));
    if ((M(indices, indices) * z).maxCoeff() > 0) {
      clear = false;
      continue;
    }
    return {Answer::kNo, "some z >= 0, z != 0, has z_i (Mz)_i <= 0 for every i",
            Witness{.indices = indices, .value = {}, .z = z, .X = {}, .Y = {}, .r = {}, .s = {}}};
  }
  if (clear) return {Answer::kYes, "every principal submatrix is an S-matrix"};
  return {Answer::kUnknown, "some principal submatrix is within 1e-7 of the boundary of the S-matrices"};
}

}  // namespace

Fact TestStrictlySemicopositive(const Matrix& M) {
  for (Index i = 0; i < M.rows(); ++i) {
    if (M(i, i) > 0) continue;
    return {
        Answer::kNo, absl::StrCat("M[", i, "][", i, "] = ", M(i, i), " is not positive"),
        Witness{.indices = {i}, .value = M(i, i), .z = Vector::Ones(1), .X = {}, .Y = {}, .r = {}, .s = {}}};
  }
  if (IsNonnegativeWithPositiveDiagonal(M)) return {Answer::kYes, "nonnegative with positive diagonal"};
  if (const Fact p = TestPMatrix(M); p.yes()) return {Answer::kYes, absl::StrCat("a P-matrix: ", p.why)};
  if (M.rows() <= kMaxLinearProgramSize) return DecideByGames(M);
  return {Answer::kUnknown, absl::StrCat("n = ", M.rows(), " is beyond the exact test (n <= ",
                                         kMaxLinearProgramSize, ") and no sufficient test applies")};
}

Fact TestSemicopositiveTypeI(const Matrix& M) {
  if (IsNonnegativeWithPositiveDiagonal(M)) return {Answer::kYes, "nonnegative with positive diagonal"};
  Fact strictly = TestStrictlySemicopositive(M);
  if (!strictly.yes()) return strictly;
  if (M == M.transpose())
    return {Answer::kYes, absl::StrCat("symmetric and strictly semicopositive: ", strictly.why)};
  if (M.rows() <= 2) return {Answer::kYes, absl::StrCat("2×2 and strictly semicopositive: ", strictly.why)};
  return {Answer::kUnknown, "strictly semicopositive, but in none of the classes known to be of type I"};
}

}  // namespace dlcs
