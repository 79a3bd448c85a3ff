// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/refined_inverse.h"

#include "core/linalg/bounded_sum.h"
#include "core/linalg/double_double.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_lu.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

constexpr double kWellConditioned = 1e3;

// sum - left · right.
Matrix Residual(const Matrix& sum, const Matrix& left, const Matrix& right) {
  Matrix residual(left.rows(), right.cols());
  for (Index j = 0; j < residual.cols(); ++j) {
    LookForStop();
    for (Index i = 0; i < residual.rows(); ++i) {
      DoubleDouble rest = sum(i, j);
      for (Index k = 0; k < left.cols(); ++k) {
        if (left(i, k) != 0 && right(k, j) != 0) rest = rest - DoubleDouble(left(i, k)) * right(k, j);
      }
      residual(i, j) = rest.Rounded();
    }
  }
  return residual;
}

bool IsWellConditioned(const Matrix& matrix, const Matrix& inverse) {
  return !(InfinityNorm(matrix) * InfinityNorm(inverse) > kWellConditioned) || !inverse.allFinite();
}

}  // namespace

Matrix RefinedInverse(const Matrix& matrix) {
  constexpr int kMaxSteps = 3;
  const Matrix identity = Matrix::Identity(matrix.rows(), matrix.rows());
  const PanelLu factors(matrix);
  Matrix inverse = factors.Solve(identity);
  if (IsWellConditioned(matrix, inverse)) return inverse;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Matrix correction = factors.Solve(Residual(identity, matrix, inverse));
    const double size = correction.cwiseAbs().maxCoeff(), of_inverse = inverse.cwiseAbs().maxCoeff();
    if (!(size < of_inverse)) break;  // so ill conditioned that it does not converge
    inverse += correction;
    if (size <= RoundingOf(8) * of_inverse) break;
  }
  return inverse;
}

Matrix RefinedQuotient(const Matrix& rows, const Matrix& matrix, const Matrix& inverse) {
  Matrix quotient = rows * inverse;
  if (rows.rows() == 0 || IsWellConditioned(matrix, inverse)) return quotient;
  const Matrix correction = Residual(rows, quotient, matrix) * inverse;
  quotient += (quotient.array() != 0).select(correction, 0);
  return quotient;
}

}  // namespace dlcs
