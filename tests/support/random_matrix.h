// SPDX-License-Identifier: Apache-2.0
// A matrix of normal numbers, the same for the same seed.

#ifndef DLCS_TESTS_SUPPORT_RANDOM_MATRIX_H_
#define DLCS_TESTS_SUPPORT_RANDOM_MATRIX_H_

#include <random>

#include "core/types.h"

namespace dlcs::testing {

inline Matrix RandomMatrix(Index rows, Index cols, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  return Matrix::NullaryExpr(rows, cols, [&] { return normal(generator); });
}

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_RANDOM_MATRIX_H_
