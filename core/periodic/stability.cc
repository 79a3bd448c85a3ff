// SPDX-License-Identifier: Apache-2.0
#include "core/periodic/stability.h"

#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <utility>

namespace dlcs {
namespace {

// Whether no matrix within the errors has the eigenvalue `z`.
bool IsNoMultiplier(std::complex<double> z, const KnownDerivative& derivative) {
  const Index m = derivative.value.rows();
  const Eigen::MatrixXcd shifted = z * Eigen::MatrixXcd::Identity(m, m) - derivative.value;
  const Matrix amplified = shifted.partialPivLu().inverse().cwiseAbs() * derivative.errors;
  return amplified.rowwise().sum().maxCoeff() < 1 && amplified.allFinite();
}

}  // namespace

KnownDerivative DerivativeAcross(const PeriodSolve& solve, const Vector& unit, bool is_oscillation) {
  Matrix value = unit.cwiseInverse().asDiagonal() * solve.flow().derivative * unit.asDiagonal();
  Matrix errors = Matrix::Zero(value.rows(), value.cols());
  if (is_oscillation) {
    // After a period what the slope is off by has shrunk as disturbances do.
    const Vector along = value * solve.flow().begin_slope.cwiseQuotient(unit);
    const Eigen::RowVectorXd part = along.transpose() / along.squaredNorm();
    errors = (value * along - along).cwiseAbs() * part.cwiseAbs();
    value -= along * part;
  }
  return {std::move(value), std::move(errors)};
}

StabilityJudgement JudgeStability(const KnownDerivative& derivative) {
  const auto multipliers = MultipliersOf(derivative.value);
  if (multipliers.empty()) return {};
  StabilityJudgement judgement{.growth = std::abs(multipliers.front()) - 1};
  bool all_inside = true;
  for (const std::complex<double>& multiplier : multipliers) {
    const double size = std::abs(multiplier);
    // Those of a pair are on the same side.
    if (multiplier.imag() < 0) continue;
    const bool is_known = IsNoMultiplier(size > 0 ? multiplier / size : 1, derivative);
    if (size > 1 && (is_known || IsNoMultiplier(multiplier / std::sqrt(size), derivative))) {
      judgement.stability = Stability::kUnstable;
      return judgement;
    }
    all_inside = all_inside && is_known;
  }
  if (all_inside) judgement.stability = Stability::kStable;
  return judgement;
}

}  // namespace dlcs
