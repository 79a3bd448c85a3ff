// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/hidden_z.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/equilibration.h"
#include "core/linalg/linear_program.h"
#include "core/linalg/norms.h"
#include "core/matrix_classes/exact_classes.h"
#include "core/matrix_classes/hidden_z_choices.h"
#include "core/matrix_classes/m_matrix.h"
#include "core/matrix_classes/principal_minors.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

constexpr Index kMaxSearchSize = 20;
constexpr Index kMaxAllChoices = 6;
constexpr int kRandomPairs = 20;

struct DualWeights {
  Vector r, s;
};

std::vector<DualWeights> FirstWeights(Index n) {
  const Vector zero = Vector::Zero(n), ones = Vector::Ones(n);
  return {{ones, zero}, {zero, ones}};
}

// Column j has an x with gᵀx > 0, g = r + Mᵀs, exactly when g is no nonnegative combination of the unit
// vectors and rows of M without the j-th of either. So in the end n of the 2n weights are positive, r_j or
// s_j for every j.
std::vector<DualWeights> RandomWeights(Index n) {
  std::mt19937_64 generator(31100);  // fixed: the answer must not change from call to call
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<DualWeights> weights;
  for (int k = 0; k < kRandomPairs; ++k) {
    DualWeights pair{Vector::Zero(n), Vector::Zero(n)};
    for (Index j = 0; j < n; ++j) (uniform(generator) < 0.5 ? pair.r : pair.s)[j] = uniform(generator);
    weights.push_back(std::move(pair));
  }
  return weights;
}

// Exactly zero in both, or smaller beyond the rounding of sums of n terms, whose absolute values add up to
// `terms`.
bool IsBelow(const Vector& value, const Vector& limit, const Vector& terms) {
  return ((limit - value).array() >= RoundingOf(8 * value.size()) * (terms + limit.cwiseAbs()).array()).all();
}

// max t over x in the unit cube with x_i <= -t and (Mx)_i <= -t for i != j; `gain`ᵀx >= t is a constraint too. Rows of
// M that are zero need no margin. Empty unless t is clear.
std::optional<Vector> Column(const Matrix& M, const Vector& gain, Index j) {
  const Index n = M.rows();
  LinearProgram program = MakeLinearProgram(2 * n + 1, n + 1);
  program.rows.topLeftCorner(n, n).setIdentity();
  program.rows.block(n, 0, n, n) = M;
  program.rows.row(2 * n).head(n) = -gain.transpose();
  program.row_upper.setZero();
  program.row_upper[j] = program.row_upper[n + j] = kUnbounded;
  for (Index row = 0; row < 2 * n + 1; ++row) {
    if (!program.rows.row(row).isZero(0)) program.rows(row, n) = 1;
  }
  program.lower.setConstant(-1);
  program.upper.setConstant(1);
  program.cost[n] = -1;
  const LinearProgramSolution column = SolveLinearProgram(program);
  if (column.verdict != LinearProgramVerdict::kOptimal || !(column.z[n] > kProgramMargin)) return std::nullopt;
  return column.z.head(n);
}

// X with columns of Column(), each with the gain that `gain_of(j)` gives.
template <typename GainOf>
std::optional<Matrix> Columns(const Matrix& M, const GainOf& gain_of) {
  Matrix X(M.rows(), M.cols());
  for (Index j = 0; j < M.cols(); ++j) {
    const std::optional<Vector> column = Column(M, gain_of(j), j);
    if (!column) return std::nullopt;
    X.col(j) = *column;
  }
  return X;
}

// The (r, s) of sum one for which the smallest entry of rᵀX + sᵀMX is largest.
std::optional<DualWeights> BestWeights(const Matrix& M, const Matrix& X) {
  const Index n = M.rows();
  LinearProgram program = MakeLinearProgram(n + 1, 2 * n + 1);
  program.rows.topLeftCorner(n, n) = X.transpose();
  program.rows.block(0, n, n, n) = (M * X).transpose();
  program.rows.col(2 * n).head(n).setConstant(-1);
  program.row_lower.head(n).setZero();
  program.rows.row(n).head(2 * n).setOnes();
  program.row_lower[n] = program.row_upper[n] = 1;
  program.lower[2 * n] = -kUnbounded;
  program.cost[2 * n] = -1;
  const LinearProgramSolution best = SolveLinearProgram(program);
  if (best.verdict != LinearProgramVerdict::kOptimal) return std::nullopt;
  return DualWeights{best.z.head(n).cwiseMax(0), best.z.segment(n, n).cwiseMax(0)};
}

// Whether (4.10) holds, by arithmetic.
bool IsProof(const Matrix& M, const Matrix& X, const DualWeights& weights) {
  const Index n = M.rows();
  if (!IsZMatrix(X)) return false;
  const Matrix Y = M * X, sizes = M.cwiseAbs() * X.cwiseAbs();
  for (Index j = 0; j < n; ++j) {
    Vector y = Y.col(j), terms = sizes.col(j);
    y[j] = terms[j] = 0;
    if (!IsBelow(y, Vector::Zero(n), terms)) return false;
  }
  const Vector image = X.transpose() * weights.r + Y.transpose() * weights.s;
  const Vector terms = X.cwiseAbs().transpose() * weights.r + 2 * sizes.transpose() * weights.s;
  if (!(image.minCoeff() > 0) || !IsBelow(-image, Vector::Zero(n), terms)) return false;
  if (X.isIdentity(0)) return true;
  const PrincipalMinor determinant = Determinant(X);
  return determinant.sign && *determinant.sign != 0;
}

Fact Found(const Matrix& M, Matrix X, DualWeights weights, std::string why) {
  Fact fact{Answer::kYes, std::move(why)};
  fact.witness.Y = M * X;
  fact.witness.X = std::move(X);
  fact.witness.r = std::move(weights.r);
  fact.witness.s = std::move(weights.s);
  return fact;
}

struct ProvenX {
  Matrix X;
  DualWeights weights;
};

// Complete but for members on the boundary.
std::optional<ProvenX> SearchAllChoices(const Matrix& M) {
  for (unsigned alpha = 0; alpha < 1u << M.rows(); ++alpha) {
    LookForStop();
    const std::optional<Matrix> X = HiddenZMatrixForChoice(M, alpha);
    if (!X) continue;
    const std::optional<DualWeights> weights = BestWeights(M, *X);
    if (weights && IsProof(M, *X, *weights)) return ProvenX{*X, *weights};
  }
  return std::nullopt;
}

// X column by column for some (r, s).
std::optional<ProvenX> SearchSomeWeights(const Matrix& M) {
  const Index n = M.rows();
  const auto with = [&](const DualWeights& weights) -> std::optional<ProvenX> {
    const Vector gain = weights.r + M.transpose() * weights.s;
    std::optional<Matrix> X = Columns(M, [&](Index) { return gain; });
    if (!X || !IsProof(M, *X, weights)) return std::nullopt;
    return ProvenX{*std::move(X), weights};
  };
  for (const DualWeights& weights : FirstWeights(n)) {
    if (auto found = with(weights)) return found;
  }
  const auto diagonal = [&](Index j) -> Vector { return Vector::Unit(n, j) + M.row(j).transpose(); };
  if (const std::optional<Matrix> X = Columns(M, diagonal)) {
    const std::optional<DualWeights> weights = BestWeights(M, *X);
    if (weights && IsProof(M, *X, *weights)) return ProvenX{*X, *weights};
  }
  for (const DualWeights& weights : RandomWeights(n)) {
    if (auto found = with(weights)) return found;
  }
  return std::nullopt;
}

// max t subject to (uᵀR)_k <= bound_k - t, u >= 0, u_j = 0, Σu = total or free; without t where column k of R and
// bound_k are zero. Empty unless the inequalities hold beyond rounding.
std::optional<Vector> Combination(const Matrix& R, const Vector& bound, Index j, std::optional<double> total) {
  const Index n = R.rows();
  LinearProgram program = MakeLinearProgram(n + 1, n + 1);
  program.rows.topLeftCorner(n, n) = R.transpose();
  for (Index k = 0; k < n; ++k) program.rows(k, n) = R.col(k).isZero(0) && bound[k] == 0 ? 0 : 1;
  program.row_upper.head(n) = bound;
  program.rows.row(n).head(n).setOnes();
  if (total) program.row_lower[n] = program.row_upper[n] = *total;
  program.upper[j] = 0;
  program.lower[n] = -1;
  program.upper[n] = 1;
  program.cost[n] = -1;
  const LinearProgramSolution solution = SolveLinearProgram(program);
  if (solution.verdict != LinearProgramVerdict::kOptimal) return std::nullopt;
  Vector u = solution.z.head(n).cwiseMax(0);
  if (!IsBelow(R.transpose() * u, bound, R.cwiseAbs().transpose() * u)) return std::nullopt;
  return u;
}

// Whether column j is impossible whatever r and s are.
std::optional<Fact> Refute(const Matrix& M, Index j) {
  Matrix turned = M;
  turned.col(j) *= -1;
  auto w = Combination(turned, Vector::Zero(M.rows()), j, 1.0);
  if (!w || !(M.col(j).dot(*w) > 0)) return std::nullopt;
  auto v = Combination(M, M.row(j).transpose(), j, std::nullopt);
  if (!v) return std::nullopt;
  Fact fact{Answer::kNo,
            absl::StrCat("no x with x_i <= 0 and (Mx)_i <= 0 for i != ", j, " has x_", j, " > 0 or (Mx)_", j, " > 0")};
  fact.witness.indices = {j};
  fact.witness.r = *std::move(w);
  fact.witness.s = *std::move(v);
  return fact;
}

bool EveryChoiceIsImpossible(const Matrix& M) {
  for (unsigned alpha = 0; alpha < 1u << M.rows(); ++alpha) {
    LookForStop();
    if (!HiddenZChoiceIsImpossible(M, alpha)) return false;
  }
  return true;
}

// The yes of ExactlyHiddenZ() with Y, r and s. Columns of X may have any length.
Fact WithWeights(const Matrix& M, Fact exact) {
  if (!exact.yes()) return exact;
  Matrix& X = exact.witness.X;
  for (Index j = 0; j < X.cols(); ++j) X.col(j) *= std::ldexp(1.0, -std::ilogb(MaxAbs(X.col(j))));
  exact.witness.Y = M * X;
  for (Index j = 0; j < M.rows(); ++j) {  // where rounding says otherwise
    for (Index i = 0; i < M.rows(); ++i) {
      if (i != j) exact.witness.Y(i, j) = std::min(exact.witness.Y(i, j), 0.0);
    }
  }
  const std::optional<DualWeights> weights = BestWeights(M, X);
  if (!weights || !((X.transpose() * weights->r + exact.witness.Y.transpose() * weights->s).minCoeff() > 0)) {
    return {Answer::kUnknown, "an X exists on the boundary of the class, but its weights are lost in rounding"};
  }
  exact.witness.r = weights->r;
  exact.witness.s = weights->s;
  return exact;
}

}  // namespace

Fact TestHiddenZ(const Matrix& M) {
  const Index n = M.rows();
  if (IsZMatrix(M)) {
    return Found(M, Matrix::Identity(n, n), {Vector::Ones(n), Vector::Zero(n)}, "a Z-matrix: X = I");
  }
  if (n > kMaxSearchSize) {
    return {Answer::kUnknown,
            absl::StrCat("no Z-matrix, and n = ", n, " is beyond the search (n <= ", kMaxSearchSize, ")")};
  }
  // R M C with X' = C⁻¹X and Y' = R Y has the same signs; the factors are powers of two, so that nothing is rounded.
  const Equilibration scale = EquilibrateRowsAndColumns(M);
  const Matrix scaled = Scaled(M, scale);
  const auto in_units_of_M = [&](Fact fact) {
    fact.witness.X = scale.column.asDiagonal() * fact.witness.X;
    fact.witness.Y = fact.witness.Y.array().colwise() / scale.row.array();
    fact.witness.r = fact.witness.r.cwiseQuotient(scale.column);
    fact.witness.s = fact.witness.s.cwiseProduct(scale.row);
    return fact;
  };
  for (Index j = 0; j < n; ++j) {
    std::optional<Fact> no = Refute(scaled, j);
    if (!no) continue;
    // Row j of R M C is compared with v' R M C: v = R v' / r_j.
    no->witness.r = no->witness.r.cwiseProduct(scale.row);
    no->witness.s = no->witness.s.cwiseProduct(scale.row) / scale.row[j];
    return *std::move(no);
  }
  if (auto found = n <= kMaxAllChoices ? SearchAllChoices(scaled) : SearchSomeWeights(scaled)) {
    auto& [X, weights] = *found;
    return in_units_of_M(Found(scaled, X, std::move(weights), "X and Y of (4.10) were found by linear programming"));
  }
  if (n > kMaxAllChoices) {
    return {Answer::kUnknown, absl::StrCat("none of ", 3 + kRandomPairs, " searches found an X with clear signs")};
  }
  if (EveryChoiceIsImpossible(scaled)) {
    return {Answer::kNo, "for every choice of r_j = 0 or s_j = 0, j = 1, ..., n, some weights exclude all X"};
  }
  if (Fact exact = WithWeights(scaled, ExactlyHiddenZ(scaled)); exact.answer != Answer::kUnknown) {
    return exact.yes() ? in_units_of_M(std::move(exact)) : exact;
  }
  return {Answer::kUnknown, "no X has clear signs, but some may on the boundary of the class"};
}

}  // namespace dlcs
