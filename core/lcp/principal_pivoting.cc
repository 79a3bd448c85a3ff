// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/principal_pivoting.h"

namespace dlcs {

bool PivotPrincipally(const ScaledLcp& lcp, int max_rounds, BasisPoint& point, Basis& basis, Index& pivots) {
  constexpr int kPatience = 5;  // block exchanges without progress; 3 to 10 are all fine in the literature
  std::size_t fewest = basis.size() + 1;
  int patience = kPatience;
  for (int round = 0; round < max_rounds; ++round) {
    if (!point.Compute(lcp, basis)) return false;
    const std::vector<Index>& infeasible = point.violations();
    if (infeasible.empty()) return point.accurate();
    if (infeasible.size() < fewest) {
      fewest = infeasible.size();
      patience = kPatience;
    } else if (patience > 0) {
      --patience;
    }
    const std::size_t count = patience > 0 ? infeasible.size() : 1;
    for (std::size_t k = 0; k < count; ++k) basis[infeasible[k]] ^= 1;
    pivots += static_cast<Index>(count);
  }
  return false;
}

}  // namespace dlcs
