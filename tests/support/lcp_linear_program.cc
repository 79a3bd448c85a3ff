// SPDX-License-Identifier: Apache-2.0
#include "tests/support/lcp_linear_program.h"

#include <ClpSimplex.hpp>
#include <CoinPackedMatrix.hpp>

namespace dlcs::testing {

std::optional<Vector> MinimizeSumOverFeasible(const Matrix& M, const Vector& q) {
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
  const Vector lower = -q;
  const Vector infinity = Vector::Constant(n, COIN_DBL_MAX);
  ClpSimplex simplex;
  simplex.setLogLevel(0);
  simplex.setPrimalTolerance(1e-9);
  simplex.setDualTolerance(1e-9);
  simplex.loadProblem(matrix, zeros.data(), infinity.data(), ones.data(), lower.data(), infinity.data());
  simplex.dual();
  if (simplex.isProvenPrimalInfeasible()) return std::nullopt;
  return Eigen::Map<const Vector>(simplex.getColSolution(), n);
}

}  // namespace dlcs::testing
