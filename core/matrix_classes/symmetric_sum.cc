// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/symmetric_sum.h"

#include <cmath>
#include <limits>

namespace dlcs {

SymmetricSum SymmetricSumBelow(const Matrix& M) {
  SymmetricSum sum{.below = M + M.transpose(), .exact = true};
  const Matrix from_transpose = sum.below - M;
  const Matrix lost = (M - (sum.below - from_transpose)) + (M.transpose() - from_transpose);
  sum.exact = lost.isZero(0);
  for (Index k = 0; k < lost.size(); ++k) {
    double& entry = sum.below.reshaped()[k];
    if (lost.reshaped()[k] < 0) entry = std::nextafter(entry, -std::numeric_limits<double>::infinity());
  }
  return sum;
}

bool FormIsClearlyNegative(const Matrix& M, const Vector& z) {
  const double unit = 4 * static_cast<double>(M.rows()) * std::numeric_limits<double>::epsilon();
  return z.dot(M * z) < -unit * z.cwiseAbs().dot(M.cwiseAbs() * z.cwiseAbs());
}

}  // namespace dlcs
