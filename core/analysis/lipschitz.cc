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
  double largest = 0;
  std::vector<Index> indices;
  for (unsigned subset = 1; subset < (1u << M.rows()); ++subset) {
    indices.clear();
    for (Index i = 0; i < M.rows(); ++i) {
      if (subset >> i & 1u) indices.push_back(i);
    }
    // Scaled, the rank is judged by one tolerance, whatever the units of the entries.
    const Matrix block = M(indices, indices);
    const Vector scale = SymmetricEquilibration(block);
    const Eigen::FullPivLU<Matrix> lu(scale.asDiagonal() * block * scale.asDiagonal());
    if (!lu.isInvertible()) continue;
    const Matrix inverse = scale.asDiagonal() * lu.inverse() * scale.asDiagonal();
    largest = std::max(largest, inverse.cwiseAbs().rowwise().sum().maxCoeff());
  }
  return largest;
}

}  // namespace

std::optional<double> LipschitzConstant(const Matrix& M) {
  if (M.rows() <= kMaxExactSize) return MaxNormOfInverses(M);
  if (!(M.diagonal().minCoeff() > 0)) return std::nullopt;
  const Matrix comparison = ComparisonMatrix(M);
  if (IsNonsingularMMatrix(comparison)) {
    // The inverse of an M-matrix is nonnegative: its norm is attained on the vector of ones.
    return comparison.partialPivLu().solve(Vector::Ones(M.rows())).maxCoeff();
  }
  if (const std::optional<double> smallest = SmallestEigenvalueIfDefinite(M)) {
    return std::sqrt(static_cast<double>(M.rows())) / *smallest;
  }
  return std::nullopt;
}

}  // namespace dlcs
