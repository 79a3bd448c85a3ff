// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/refined_inverse.h"

#include <algorithm>
#include <cmath>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/double_double.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_lu.h"
#include "core/linalg/panel_product.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// I - matrix · inverse in twice the digits, rounded.
Matrix ResidualOf(const Matrix& matrix, const Matrix& inverse) {
  Matrix residual(matrix.rows(), inverse.cols());
  for (Index j = 0; j < residual.cols(); ++j) {
    LookForStop();
    for (Index i = 0; i < residual.rows(); ++i) {
      DoubleDouble rest = i == j ? 1 : 0;
      for (Index k = 0; k < matrix.cols(); ++k) {
        if (matrix(i, k) != 0 && inverse(k, j) != 0) rest = rest - DoubleDouble(matrix(i, k)) * inverse(k, j);
      }
      residual(i, j) = rest.Rounded();
    }
  }
  return residual;
}

}  // namespace

RefinedInverse::RefinedInverse(const Matrix& matrix) {
  constexpr double kWellConditioned = 1e3;
  constexpr int kMaxSteps = 3;
  const PanelLu factors(matrix);
  value_ = factors.Solve(Matrix::Identity(matrix.rows(), matrix.rows()));
  if (!(InfinityNorm(matrix) * InfinityNorm(value_) > kWellConditioned) || !value_.allFinite()) return;
  double of_factors = 0;  // the relative error of a solve with them
  for (int step = 0; true; ++step) {
    const Matrix correction = factors.Solve(ResidualOf(matrix, value_));
    const double size = correction.cwiseAbs().maxCoeff(), of_value = value_.cwiseAbs().maxCoeff();
    if (step == 0) of_factors = size / of_value;
    if (!(of_factors < 1)) return;  // so ill conditioned that it does not converge
    if (size <= RoundingOf(2) * of_value || step == kMaxSteps) {
      rest_ = correction;
      error_ = std::max(of_factors, RoundingOf(1)) * RoundingOf(1);
      return;
    }
    value_ += correction;
  }
}

Matrix RefinedInverse::Quotient(const Matrix& rows) const {
  if (!is_refined()) return Product(rows, value_);
  Matrix quotient(rows.rows(), value_.cols());
  for (Index j = 0; j < quotient.cols(); ++j) {
    LookForStop();
    for (Index i = 0; i < quotient.rows(); ++i) {
      DoubleDouble sum = 0;
      double terms = 0;
      for (Index k = 0; k < rows.cols(); ++k) {
        if (rows(i, k) == 0 || value_(k, j) == 0) continue;
        sum = sum + DoubleDouble(rows(i, k)) * DoubleDouble(value_(k, j), rest_(k, j));
        terms += std::abs(rows(i, k) * value_(k, j));
      }
      quotient(i, j) = std::abs(sum.Rounded()) > error_ * terms ? sum.Rounded() : 0;
    }
  }
  return quotient;
}

}  // namespace dlcs
