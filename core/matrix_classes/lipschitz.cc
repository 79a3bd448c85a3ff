// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/lipschitz.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/equilibration.h"
#include "core/linalg/pseudo_inverse.h"
#include "core/matrix_classes/m_matrix.h"
#include "core/matrix_classes/positive_semidefinite.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

constexpr Index kMaxPiecewiseSize = 12;
constexpr Index kMaxRowBasesSize = 8;

// Calls visit(S) for every nonempty subset S of 0, ..., n - 1, in increasing order of indices.
template <typename Visit>
void ForSubsets(Index n, const Visit& visit) {
  std::vector<Index> indices;
  for (unsigned subset = 1; subset < (1u << n); ++subset) {
    LookForStop();
    indices.clear();
    for (Index i = 0; i < n; ++i) {
      if (subset >> i & 1u) indices.push_back(i);
    }
    visit(indices);
  }
}

// Scaled so, the rank of a submatrix is judged by one tolerance, whatever the units of the entries.
struct ScaledForRank {
  explicit ScaledForRank(const Matrix& M)
      : scale(SymmetricEquilibration(M)), matrix(scale.asDiagonal() * M * scale.asDiagonal()) {}
  Vector scale;
  Matrix matrix;
};

double MaxNormOfInverses(const Matrix& M) {
  const ScaledForRank scaled(M);
  double largest = 0;
  Eigen::FullPivLU<Matrix> lu;
  ForSubsets(M.rows(), [&](const std::vector<Index>& S) {
    lu.compute(scaled.matrix(S, S));
    if (!lu.isInvertible()) return;
    // Row sums of |D S⁻¹ D|.
    const Vector row_sums = lu.inverse().cwiseAbs() * scaled.scale(S);
    largest = std::max(largest, row_sums.cwiseProduct(scaled.scale(S)).maxCoeff());
  });
  return largest;
}

double MaxNormOfRowBases(const Matrix& M) {
  const Index n = M.rows();
  Matrix P(2 * n, n);
  P << M, Matrix::Identity(n, n);
  double largest = 1;  // B = I
  Eigen::FullPivLU<Matrix> lu;
  ForSubsets(2 * n, [&](const std::vector<Index>& rows) {
    if (static_cast<Index>(rows.size()) != n) return;
    // Rows of M may be tiny: scaled to size one, so that the rank does not depend on it.
    const Matrix B = P(rows, Eigen::all);
    const Vector size = B.rowwise().lpNorm<Eigen::Infinity>();
    if (!(size.minCoeff() > 0)) return;
    lu.compute(size.cwiseInverse().asDiagonal() * B);
    if (!lu.isInvertible()) return;
    const Matrix inverse = lu.inverse() * size.cwiseInverse().asDiagonal();
    largest = std::max(largest, inverse.cwiseAbs().rowwise().sum().maxCoeff());
  });
  return largest;
}

}  // namespace

LipschitzBound BoundLipschitz(const Matrix& M) {
  const bool positive_diagonal = M.diagonal().minCoeff() > 0;
  const Matrix comparison = ComparisonMatrix(M);
  std::vector<Index> all(static_cast<std::size_t>(M.rows()));
  std::iota(all.begin(), all.end(), Index{0});
  MMatrixFactor factor(comparison);
  const bool h_matrix = positive_diagonal && factor.Factor(comparison, all) == M.rows();
  const auto norm_of_inverse_comparison = [&] {
    // The inverse of an M-matrix is nonnegative: its norm is attained on the vector of ones.
    Vector row_sums = Vector::Ones(M.rows());
    factor.Solve(row_sums);
    return row_sums.maxCoeff();
  };
  if (h_matrix && IsZMatrix(M)) {
    return {norm_of_inverse_comparison(), ConstantKind::kExact, "the norm of the inverse of the M-matrix M"};
  }
  if (M.rows() <= kMaxPiecewiseSize) {
    return {MaxNormOfInverses(M), ConstantKind::kExact, "the largest norm of an inverse of a principal submatrix"};
  }
  if (h_matrix) {
    return {norm_of_inverse_comparison(), ConstantKind::kUpperBound,
            "the norm of the inverse of the comparison matrix of the H-matrix M"};
  }
  if (const std::optional<double> smallest = SmallestEigenvalueIfDefinite(M)) {
    return {std::sqrt(static_cast<double>(M.rows())) / *smallest, ConstantKind::kUpperBound,
            absl::StrCat("√n over the smallest eigenvalue ", *smallest, " of the symmetric part of M")};
  }
  return {std::nullopt, ConstantKind::kExact,
          absl::StrCat("n = ", M.rows(),
                       " is beyond enumeration, and M is neither an M- nor an H-matrix, nor positive definite")};
}

std::optional<double> LipschitzConstant(const Matrix& M) { return BoundLipschitz(M).value; }

std::optional<double> LargestSlope(const Matrix& M) {
  if (M.rows() > kMaxPiecewiseSize) return std::nullopt;
  double largest = 0;
  ForSubsets(M.rows(), [&](const std::vector<Index>& S) {
    largest = std::max(largest, FactorOfAnyRank(M(S, S)).pseudoInverse().cwiseAbs().rowwise().sum().maxCoeff());
  });
  return largest;
}

LipschitzBound MangasarianShiauConstant(const Matrix& M) {
  if (M.rows() <= kMaxRowBasesSize) {
    return {MaxNormOfRowBases(M), ConstantKind::kExact, "the largest norm of an inverse of n rows of (M; I)"};
  }
  const LipschitzBound lipschitz = BoundLipschitz(M);
  const bool exact = lipschitz.value && lipschitz.kind == ConstantKind::kExact;
  return {exact ? std::max(1.0, *lipschitz.value) : 1.0, ConstantKind::kLowerBound,
          exact ? "n is beyond enumeration; at least max(1, 𝓛)" : "n is beyond enumeration; at least 1"};
}

}  // namespace dlcs
