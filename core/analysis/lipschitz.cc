// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/lipschitz.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/analysis/equilibration.h"
#include "core/analysis/m_matrix.h"
#include "core/analysis/positive_semidefinite.h"

namespace dlcs {
namespace {

constexpr Index kMaxExactSize = 12;

double MaxNormOfInverses(const Matrix& M) {
  // Scaled, the rank is judged by one tolerance, whatever the units of the entries.
  const Vector scale = SymmetricEquilibration(M);
  const Matrix scaled = scale.asDiagonal() * M * scale.asDiagonal();
  double largest = 0;
  std::vector<Index> indices;
  Eigen::FullPivLU<Matrix> lu;
  for (unsigned subset = 1; subset < (1u << M.rows()); ++subset) {
    indices.clear();
    for (Index i = 0; i < M.rows(); ++i) {
      if (subset >> i & 1u) indices.push_back(i);
    }
    lu.compute(scaled(indices, indices));
    if (!lu.isInvertible()) continue;
    // Row sums of |D S⁻¹ D|.
    const Vector row_sums = lu.inverse().cwiseAbs() * scale(indices);
    largest = std::max(largest, row_sums.cwiseProduct(scale(indices)).maxCoeff());
  }
  return largest;
}

}  // namespace

std::optional<double> LipschitzConstant(const Matrix& M) {
  const bool positive_diagonal = M.diagonal().minCoeff() > 0;
  const Matrix comparison = ComparisonMatrix(M);
  const bool h_matrix = positive_diagonal && IsNonsingularMMatrix(comparison);
  const auto norm_of_inverse_comparison = [&] {
    // The inverse of an M-matrix is nonnegative: its norm is attained on the vector of ones.
    return comparison.partialPivLu().solve(Vector::Ones(M.rows())).maxCoeff();
  };
  if (h_matrix && IsZMatrix(M)) return norm_of_inverse_comparison();
  if (M.rows() <= kMaxExactSize) return MaxNormOfInverses(M);
  if (h_matrix) return norm_of_inverse_comparison();
  if (const std::optional<double> smallest = SmallestEigenvalueIfDefinite(M)) {
    return std::sqrt(static_cast<double>(M.rows())) / *smallest;
  }
  return std::nullopt;
}

}  // namespace dlcs
