// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/relative_degree.h"

#include <cmath>
#include <limits>

namespace dlcs {

std::optional<int> RelativeDegree(const Matrix& A, const Matrix& B, const Matrix& N) {
  const Index num_states = A.rows();
  const double rounding = 16 * std::numeric_limits<double>::epsilon() * static_cast<double>(num_states);
  const Matrix abs_A = A.cwiseAbs();
  const Matrix abs_N = N.cwiseAbs();
  Matrix power = B;             // A^{k-1} B, up to a factor
  Matrix bound = B.cwiseAbs();  // |A|^{k-1} |B|, up to the same factor
  for (int k = 1; k <= num_states; ++k) {
    const double largest = bound.size() == 0 ? 0 : bound.maxCoeff();
    if (!(largest > 0)) return std::nullopt;
    const double factor = std::exp2(-std::ilogb(largest));  // keeps high powers within range
    power *= factor;
    bound *= factor;
    const Matrix markov = N * power;
    const Matrix markov_bound = abs_N * bound;
    if ((markov.array().abs() > rounding * k * markov_bound.array()).any()) return k;
    power = (A * power).eval();
    bound = (abs_A * bound).eval();
  }
  return std::nullopt;
}

}  // namespace dlcs
