// SPDX-License-Identifier: Apache-2.0
#include "core/periodic/stability.h"

#include <Eigen/LU>
#include <cmath>
#include <complex>

namespace dlcs {
namespace {

// Whether no matrix within `errors` of `derivative` has the eigenvalue `z`.
bool IsNoMultiplier(std::complex<double> z, const Matrix& derivative, const Matrix& errors) {
  const Index m = derivative.rows();
  const Eigen::MatrixXcd shifted = z * Eigen::MatrixXcd::Identity(m, m) - derivative;
  const Matrix amplified = shifted.partialPivLu().inverse().cwiseAbs() * errors;
  return amplified.rowwise().sum().maxCoeff() < 1 && amplified.allFinite();
}

}  // namespace

Matrix DerivativeAcross(const PeriodSolve& solve, const Vector& unit, bool is_oscillation) {
  Matrix derivative = unit.cwiseInverse().asDiagonal() * solve.flow().derivative * unit.asDiagonal();
  if (is_oscillation) {
    const Vector along = solve.flow().begin_slope.cwiseQuotient(unit);
    derivative -= along * along.transpose() / along.squaredNorm();
  }
  return derivative;
}

StabilityJudgement JudgeStability(const Matrix& derivative, const Matrix& errors) {
  const auto multipliers = MultipliersOf(derivative);
  if (multipliers.empty()) return {};
  StabilityJudgement judgement{.growth = std::abs(multipliers.front()) - 1};
  bool all_inside = true;
  for (const std::complex<double>& multiplier : multipliers) {
    const double size = std::abs(multiplier);
    // Those of a pair are on the same side.
    if (multiplier.imag() < 0) continue;
    const bool is_known = IsNoMultiplier(size > 0 ? multiplier / size : 1, derivative, errors);
    if (size > 1 && (is_known || IsNoMultiplier(multiplier / std::sqrt(size), derivative, errors))) {
      judgement.stability = Stability::kUnstable;
      return judgement;
    }
    all_inside = all_inside && is_known;
  }
  if (all_inside) judgement.stability = Stability::kStable;
  return judgement;
}

}  // namespace dlcs
