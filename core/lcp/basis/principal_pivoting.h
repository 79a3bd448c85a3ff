// SPDX-License-Identifier: Apache-2.0
// Block principal pivoting for P-matrices.

#ifndef DLCS_CORE_LCP_BASIS_PRINCIPAL_PIVOTING_H_
#define DLCS_CORE_LCP_BASIS_PRINCIPAL_PIVOTING_H_

#include <cstddef>
#include <vector>

#include "core/lcp/basis/lcp_solver.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

enum class Exchange {
  kBlocks,           // all infeasible indices in every round: enough for an M-matrix
  kBlocksThenLeast,  // one at a time where blocks make no progress
};

// Moves from `basis` to a basis whose point solves `lcp`: all infeasible indices change sides at once (a
// semismooth Newton step); with kBlocksThenLeast, when their number has not dropped for a few rounds, only
// the least of them does until it drops (Murty's rule). On a P-matrix that is finite from any start, in exact
// arithmetic; on an M-matrix blocks alone are: y rises from one round to the next (the new equations, taken
// at the old y, have residuals
// <= 0), so an index whose y_i has once been zero never leaves again, although many rounds may add only a few.
//
// `point` has Compute(lcp, basis), violations() and accurate() as BasisPoint has. True when it is solved.
// False when a basis on the way is singular, or after `max_rounds` rounds: neither says anything about
// solutions. Adds the exchanges to `pivots`. One factorization per round.
//
// Source: [Júdice & Pires 1994] J. J. Júdice, F. M. Pires. A block principal pivoting algorithm for
//         large-scale strictly monotone linear complementarity problems. Computers & Operations Research 21, 587-596.
template <typename Lcp, typename Point>
bool PivotPrincipally(const Lcp& lcp, int max_rounds, Exchange exchange, Point& point, Basis& basis, Index& pivots) {
  constexpr int kPatience = 5;  // block exchanges without progress; 3 to 10 are all fine in the literature
  std::size_t fewest = basis.size() + 1;
  int patience = kPatience;
  for (int round = 0; round < max_rounds; ++round) {
    LookForStop();
    if (!point.Compute(lcp, basis)) return false;
    const std::vector<Index>& infeasible = point.violations();
    if (infeasible.empty()) return point.accurate();
    if (infeasible.size() < fewest || exchange == Exchange::kBlocks) {
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

#endif  // DLCS_CORE_LCP_BASIS_PRINCIPAL_PIVOTING_H_
