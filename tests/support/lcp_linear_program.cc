// SPDX-License-Identifier: Apache-2.0
#include "tests/support/lcp_linear_program.h"

#include <ClpSimplex.hpp>
#include <CoinPackedMatrix.hpp>

namespace dlcs::testing {

namespace {

// argmin { Σ y_i : 0 <= y <= y_upper, lower <= M y <= upper }.
std::optional<Vector> MinimizeSum(const Matrix& M, const Vector& y_upper, const Vector& lower,
                                  const Vector& upper) {
  const int n = static_cast<int>(M.rows());
  CoinPackedMatrix matrix(/*colordered=*/true, 0, 0);
  matrix.setDimensions(n, n);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      if (M(i, j) != 0) matrix.modifyCoefficient(i, j, M(i, j));
    }
  }
  const Vector zeros = Vector::Zero(n);
  const Vector ones = Vector::Ones(n);
  ClpSimplex simplex;
  simplex.setLogLevel(0);
  simplex.setPrimalTolerance(1e-9);
  simplex.setDualTolerance(1e-9);
  simplex.loadProblem(matrix, zeros.data(), y_upper.data(), ones.data(), lower.data(), upper.data());
  simplex.dual();
  if (simplex.isProvenPrimalInfeasible()) return std::nullopt;
  return Eigen::Map<const Vector>(simplex.getColSolution(), n);
}

}  // namespace

std::optional<Vector> MinimizeSumOverFeasible(const Matrix& M, const Vector& q) {
  const Vector infinity = Vector::Constant(q.size(), COIN_DBL_MAX);
  return MinimizeSum(M, infinity, -q, infinity);
}

bool HasSolutionByEnumeration(const Matrix& M, const Vector& q) {
  const Index n = q.size();
  for (unsigned subset = 0; subset < (1u << n); ++subset) {
    Vector y_upper = Vector::Zero(n);
    Vector w_upper = Vector::Constant(n, COIN_DBL_MAX);
    for (Index i = 0; i < n; ++i) {
      if ((subset >> i & 1u) == 0) continue;
      y_upper[i] = COIN_DBL_MAX;
      w_upper[i] = -q[i];
    }
    if (MinimizeSum(M, y_upper, -q, w_upper).has_value()) return true;
  }
  return false;
}

}  // namespace dlcs::testing
