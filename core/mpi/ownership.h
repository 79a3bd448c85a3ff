// SPDX-License-Identifier: Apache-2.0
// Which rank has which rows.

#ifndef DLCS_CORE_MPI_OWNERSHIP_H_
#define DLCS_CORE_MPI_OWNERSHIP_H_

#include <utility>
#include <vector>

#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// Rows, or unknowns, by their owners; those of a rank keep their order.
class Ownership {
 public:
  // `owners`: the rank of each row.
  Ownership(std::vector<int> owners, int ranks) : owners_(std::move(owners)), rows_(static_cast<std::size_t>(ranks)) {
    local_.reserve(owners_.size());
    for (std::size_t i = 0; i < owners_.size(); ++i) {
      std::vector<Index>& of_owner = rows_[static_cast<std::size_t>(owners_[i])];
      local_.push_back(static_cast<Index>(of_owner.size()));
      of_owner.push_back(static_cast<Index>(i));
    }
  }

  Index size() const { return static_cast<Index>(owners_.size()); }
  int owner(Index row) const { return owners_[static_cast<std::size_t>(row)]; }
  // The place of a row among those of its owner.
  Index local(Index row) const { return local_[static_cast<std::size_t>(row)]; }
  const std::vector<Index>& rows(int rank) const { return rows_[static_cast<std::size_t>(rank)]; }
  Index count(int rank) const { return static_cast<Index>(rows(rank).size()); }

 private:
  std::vector<int> owners_;
  std::vector<Index> local_;
  std::vector<std::vector<Index>> rows_;
};

// States in blocks of neighbors, of sizes that differ by one at most.
Ownership StatesByBlocks(Index states, int ranks);
// A pair goes with the first state that it is about, so that an obstacle is where its state is.
Ownership PairsByStates(const Problem& problem, const Ownership& states, int ranks);

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_OWNERSHIP_H_
