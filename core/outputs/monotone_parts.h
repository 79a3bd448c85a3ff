// SPDX-License-Identifier: Apache-2.0
// Where a product of polynomials rises and where it falls.

#ifndef DLCS_CORE_OUTPUTS_MONOTONE_PARTS_H_
#define DLCS_CORE_OUTPUTS_MONOTONE_PARTS_H_

#include <limits>
#include <vector>

#include "core/discretization/legendre.h"

namespace dlcs {

struct ValueRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

// Increasing s from -1 to 1, both included. Between neighbors the product of the rows of `factors` is monotone, but for
// 1e-13 of its size on [-1, 1], or lies below or above `range`. No turning point in the range is missed, however close
// together they are: a polynomial is monotone where its Bernstein coefficients are, has one turning point where their
// differences change sign once, and is bisected elsewhere. Where a coefficient is not finite, -1 and 1 alone. Cost:
// some K² without a turn in the range.
std::vector<double> MonotoneParts(const LegendreSeries& factors, ValueRange range = {});

}  // namespace dlcs

#endif  // DLCS_CORE_OUTPUTS_MONOTONE_PARTS_H_
