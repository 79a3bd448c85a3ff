// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/hidden_z_choices.h"

#include <cmath>
#include <vector>

#include "core/linalg/linear_program.h"

namespace dlcs {
namespace {

// The rows e_j, and M_j for j in `alpha`.
Matrix Generators(const Matrix& M, unsigned alpha) {
  Matrix G = Matrix::Identity(M.rows(), M.cols());
  for (Index j = 0; j < M.rows(); ++j) {
    if (alpha >> j & 1u) G.row(j) = M.row(j);
  }
  return G;
}

// Whether g - Σ_{i != j} b_i M_i is zero in entry j and positive in the others for some b next to that given.
// Rounding and CLP leave an entry of 1e-9 or so: it becomes zero when one b_i is moved, by less than what the
// margin of the others and of b_i allow.
bool IsCombinationBeyondRounding(const Matrix& M, const Vector& g, const Vector& b, Index j) {
  constexpr double kLargestMultiplier = 1e3, kRounding = 1e-10;
  if (b.maxCoeff() > kLargestMultiplier || b[j] != 0) return false;
  Vector rest = g - M.transpose() * b;
  const double residual = std::abs(rest[j]) + kRounding;  // of sums of size 1e3
  rest[j] = kUnbounded;
  const double margin = rest.minCoeff() - kRounding;
  for (Index i = 0; i < M.rows(); ++i) {
    if (i == j) continue;
    const double move = residual / std::abs(M(i, j));
    if (move < b[i] && move * M.row(i).lpNorm<Eigen::Infinity>() < margin) return true;
  }
  return false;
}

// w, and in column j the multipliers of the rows of M for column j of X.
struct Exclusion {
  Vector w;
  Matrix b;
};

// Some w >= 0 of sum one, zero outside `support`, for which Gᵀw - Σ_{i != j} b_ij M_i has the entry j zero
// and the others nonnegative, for every j in `support`; with a margin, these and b are as large as possible.
std::optional<Exclusion> Exclude(const Matrix& M, const Matrix& G, const std::vector<bool>& support, bool with_margin) {
  const Index n = M.rows();
  const Index t = n + n * n;  // the margin, behind w and b
  LinearProgram program = MakeLinearProgram(2 * n * n + 1, t + 1);
  for (Index j = 0; j < n; ++j) {
    program.upper[n + n * j + j] = 0;
    if (!support[static_cast<std::size_t>(j)]) {
      program.upper[j] = 0;
      continue;
    }
    program.rows.block(n * j, 0, n, n) = G.transpose();
    program.rows.block(n * j, n + n * j, n, n) = -M.transpose();
    program.rows.col(t).segment(n * j, n).setConstant(-1);
    program.rows(n * j + j, t) = 0;
    program.row_lower.segment(n * j, n).setZero();
    program.row_upper[n * j + j] = 0;
    for (Index i = 0; i < n; ++i) {  // b_ij is to be positive too
      if (i == j) continue;
      const Index row = n * n + n * j + i;
      program.rows(row, n + n * j + i) = 1;
      program.rows(row, t) = -1;
      program.row_lower[row] = 0;
    }
  }
  program.rows.row(2 * n * n).head(n).setOnes();
  program.row_lower[2 * n * n] = program.row_upper[2 * n * n] = 1;
  program.upper[t] = with_margin ? 1 : 0;
  program.cost[t] = -1;
  const LinearProgramSolution solution = SolveLinearProgram(program);
  if (solution.verdict != LinearProgramVerdict::kOptimal) return std::nullopt;
  const Vector z = solution.z.cwiseMax(0);
  return Exclusion{z.head(n), Matrix(z.segment(n, n * n).reshaped(n, n))};
}

bool IsProof(const Matrix& M, const Matrix& G, const Exclusion& exclusion) {
  const Vector g = G.transpose() * exclusion.w;
  for (Index j = 0; j < M.rows(); ++j) {
    if (exclusion.w[j] > 0 && !IsCombinationBeyondRounding(M, g, exclusion.b.col(j), j)) return false;
  }
  return true;
}

}  // namespace

std::optional<Matrix> HiddenZMatrixForChoice(const Matrix& M, unsigned alpha) {
  const Index n = M.rows();
  const Index t = n * n;  // behind the columns of X
  const Matrix G = Generators(M, alpha);
  LinearProgram program = MakeLinearProgram(2 * n * n + n, n * n + 1);
  for (Index j = 0; j < n; ++j) {
    const Index first = 2 * n * j;
    program.rows.block(first, n * j, n, n).setIdentity();
    program.rows.block(first + n, n * j, n, n) = M;
    program.rows.block(2 * n * n, n * j, n, n) = -G;
    program.row_upper.segment(first, 2 * n).setZero();
    program.row_upper[first + j] = program.row_upper[first + n + j] = kUnbounded;
  }
  program.row_upper.tail(n).setZero();
  for (Index row = 0; row < program.rows.rows(); ++row) {
    if (row >= 2 * n * n || !program.rows.row(row).isZero(0)) program.rows(row, t) = 1;
  }
  program.lower.setConstant(-1);
  program.upper.setConstant(1);
  program.cost[t] = -1;
  const LinearProgramSolution solution = SolveLinearProgram(program);
  if (solution.verdict != LinearProgramVerdict::kOptimal || !(solution.z[t] > kProgramMargin)) return std::nullopt;
  return Matrix(solution.z.head(t).reshaped(n, n));
}

bool HiddenZChoiceIsImpossible(const Matrix& M, unsigned alpha) {
  const Matrix G = Generators(M, alpha);
  std::vector<bool> support(static_cast<std::size_t>(M.rows()), true);
  // For column j with w_j = 0 the sum Gᵀw itself is the combination, so only the others need a margin. The first
  // program has no margin and finds the support.
  for (const bool with_margin : {false, true}) {
    const std::optional<Exclusion> found = Exclude(M, G, support, with_margin);
    if (!found) return false;
    if (with_margin) return IsProof(M, G, *found);
    for (std::size_t j = 0; j < support.size(); ++j) support[j] = found->w[static_cast<Index>(j)] > kProgramMargin;
  }
  return false;
}

}  // namespace dlcs
