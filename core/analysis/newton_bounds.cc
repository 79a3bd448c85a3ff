// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/newton_bounds.h"

#include "core/linalg/norms.h"

namespace dlcs {

std::optional<double> RightHandSideLipschitz(const Problem& problem, const std::optional<double>& lipschitz) {
  if (!lipschitz) return std::nullopt;
  return InfinityNorm(problem.A) + *lipschitz * InfinityNorm(problem.B) * InfinityNorm(problem.N);
}

}  // namespace dlcs
