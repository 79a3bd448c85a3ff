// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/ownership.h"

#include <algorithm>

namespace dlcs {

Ownership StatesByBlocks(Index states, int ranks) {
  std::vector<int> owners(static_cast<std::size_t>(states));
  for (Index i = 0; i < states; ++i) owners[static_cast<std::size_t>(i)] = static_cast<int>(i * ranks / states);
  return Ownership(std::move(owners), ranks);
}

Ownership PairsByStates(const Problem& problem, const Ownership& states, int ranks) {
  const auto n = static_cast<std::size_t>(problem.num_constraints());
  std::vector<Index> first(n, states.size());
  const SparseMatrix N = problem.N.Sparse(), B = problem.B.Sparse();
  for (Index c = N.outerSize(); c-- > 0;) {
    for (SparseMatrix::InnerIterator entry(N, c); entry; ++entry) {
      if (entry.value() != 0) first[static_cast<std::size_t>(entry.row())] = c;
    }
  }
  for (Index i = 0; i < B.outerSize(); ++i) {
    Index& of_pair = first[static_cast<std::size_t>(i)];
    if (of_pair < states.size()) continue;
    const SparseMatrix::InnerIterator entry(B, i);
    of_pair = entry ? entry.row() : 0;
  }
  std::vector<int> owners(n);
  std::transform(first.begin(), first.end(), owners.begin(), [&](Index state) { return states.owner(state); });
  return Ownership(std::move(owners), ranks);
}

}  // namespace dlcs
