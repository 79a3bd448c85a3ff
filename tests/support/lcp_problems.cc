// SPDX-License-Identifier: Apache-2.0
#include "tests/support/lcp_problems.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace dlcs::testing {

Matrix LcpGenerator::Gaussian(Index rows, Index columns) {
  Matrix result(rows, columns);
  for (Index j = 0; j < columns; ++j) {
    for (Index i = 0; i < rows; ++i) result(i, j) = Normal();
  }
  return result;
}

Matrix LcpGenerator::MMatrix(Index n) {
  Matrix M = -Gaussian(n, n).cwiseAbs();
  M.diagonal().setZero();
  const Vector column_sums = M.cwiseAbs().colwise().sum();
  for (Index i = 0; i < n; ++i) M(i, i) = column_sums[i] * Uniform(1.01, 1.5) + Uniform(0.1, 1);
  return M;
}

Matrix LcpGenerator::SingularMMatrix(Index n) {
  Matrix M = -Gaussian(n, n).cwiseAbs();
  M.diagonal().setZero();
  M.diagonal() = -M.rowwise().sum();
  return M;
}

Matrix LcpGenerator::ZMatrix(Index n) {
  Matrix M = -Gaussian(n, n).cwiseAbs();
  for (Index j = 0; j < n; ++j) {
    for (Index i = 0; i < n; ++i) {
      if (i != j && Uniform(0, 1) < 0.5) M(i, j) = 0;
    }
    M(j, j) = Uniform(0, 1) < 0.2 ? 0 : Uniform(-0.3, 1) * static_cast<double>(n);
  }
  return M;
}

Matrix LcpGenerator::PositiveDefinite(Index n) {
  const Matrix G = Gaussian(n, n);
  return G * G.transpose() / static_cast<double>(n) + 0.1 * Matrix::Identity(n, n) + Skew(n);
}

Matrix LcpGenerator::IndefinitePMatrix(Index n) {
  Matrix M = Matrix::Zero(n, n);
  for (Index j = 0; j < n; ++j) {
    M(j, j) = Uniform(0.5, 2);
    for (Index i = 0; i < j; ++i) M(i, j) = 3 * Normal();
  }
  // 2×2 diagonal blocks with entries of opposite sign: determinants grow, so all minors stay positive.
  for (Index j = 0; j + 1 < n; j += 2) M(j + 1, j) = -0.4 * M(j, j + 1);
  std::vector<Index> order(n);
  std::iota(order.begin(), order.end(), Index{0});
  std::shuffle(order.begin(), order.end(), engine_);
  return M(order, order);
}

Matrix LcpGenerator::Skew(Index n) {
  const Matrix G = Gaussian(n, n);
  return (G - G.transpose()) / std::sqrt(static_cast<double>(n));
}

Matrix LcpGenerator::PositiveSemidefinite(Index n, Index rank) {
  const Matrix G = Gaussian(n, rank);
  return G * G.transpose() / static_cast<double>(n) + Skew(n);
}

Matrix LcpGenerator::BadlyScaled(const Matrix& M, double decades) {
  Vector scale(M.rows());
  for (Index i = 0; i < scale.size(); ++i) scale[i] = std::pow(10.0, Uniform(-decades, decades));
  return scale.asDiagonal() * M * scale.asDiagonal();
}

Vector LcpGenerator::SolvableQ(const Matrix& M, bool degenerate, Vector* y) {
  const Index n = M.rows();
  Vector solution = Vector::Zero(n);
  Vector w = Vector::Zero(n);
  for (Index i = 0; i < n; ++i) {
    const double draw = Uniform(0, 1);
    if (degenerate && draw < 0.3) continue;
    (draw < 0.65 ? solution : w)[i] = Uniform(0.1, 2);
  }
  if (y != nullptr) *y = solution;
  return w - M * solution;
}

Matrix ChenXiangExample41() { return Matrix{{1, 0, 0, 0}, {0, 0, -1, 0}, {0, -1, 0, 0}, {0, 0, 0, 1}}; }

Matrix WuChenExample42() {
  return Matrix{{2. / 3, -1, -1. / 3, -5. / 3},
                {-2. / 3, 1. / 3, -2. / 3, -4. / 3},
                {-2. / 3, -1. / 30, 0, -5. / 3},
                {-1, 0, -5. / 3, 1. / 3}};
}

}  // namespace dlcs::testing
