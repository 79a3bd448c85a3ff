// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/equilibration.h"

#include <algorithm>
#include <cmath>

namespace dlcs {

Vector SymmetricEquilibration(const Matrix& M) {
  // The distance to size one halves (in the exponent) with every round: doubles need ten at most.
  constexpr int kRounds = 10;
  const Matrix magnitude = M.cwiseAbs().cwiseMax(M.cwiseAbs().transpose());
  Vector scale = Vector::Ones(M.rows());
  Vector largest(M.rows());
  for (int round = 0; round < kRounds; ++round) {
    for (Index i = 0; i < M.rows(); ++i) {
      largest[i] = scale[i] * magnitude.col(i).cwiseProduct(scale).maxCoeff();
    }
    for (Index i = 0; i < M.rows(); ++i) {
      if (largest[i] > 0) scale[i] /= std::sqrt(largest[i]);
    }
  }
  // Scales beyond 2^±500 would only matter next to overflow.
  return scale.unaryExpr(
      [](double s) { return std::exp2(std::clamp(std::round(std::log2(s)), -500.0, 500.0)); });
}

}  // namespace dlcs
