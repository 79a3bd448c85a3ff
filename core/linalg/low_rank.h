// SPDX-License-Identifier: Apache-2.0
// A matrix as a product of few columns and few rows.

#ifndef DLCS_CORE_LINALG_LOW_RANK_H_
#define DLCS_CORE_LINALG_LOW_RANK_H_

#include <optional>

#include "core/types.h"

namespace dlcs {

struct LowRank {
  Matrix columns;  // m × r, orthonormal
  Matrix rows;     // r × k
};

// matrix = columns · rows up to rounding, by Gram and Schmidt with the longest column first. Cost: 4 m k r.
LowRank FactorByRank(Matrix matrix);

// The same up to an error of `negligible` in each column, if at most `most` terms are enough; otherwise absent, at the
// cost of `most` terms.
std::optional<LowRank> FactorIfRankIsAtMost(Index most, double negligible, Matrix matrix);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_LOW_RANK_H_
