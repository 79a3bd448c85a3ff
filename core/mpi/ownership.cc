// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/ownership.h"

#include <algorithm>
#include <numeric>

namespace dlcs {

Ownership::Ownership(const std::vector<Run>& runs, Index rows, int ranks)
    : first_(static_cast<std::size_t>(ranks) + 1, 0) {
  std::vector<Index> counts(static_cast<std::size_t>(ranks), 0);
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Index end = k + 1 < runs.size() ? runs[k + 1].begin : rows;
    if (end == runs[k].begin) continue;
    Index& count = counts[static_cast<std::size_t>(runs[k].owner)];
    runs_.push_back({runs[k].begin, count, runs[k].owner});
    count += end - runs[k].begin;
  }
  std::partial_sum(counts.begin(), counts.end(), first_.begin() + 1);
}

Ownership Ownership::Blocks(Index rows, int ranks) {
  std::vector<Index> sizes;
  // Row i is that of rank ⌊i · ranks / rows⌋.
  const auto begin = [&](Index rank) { return (rank * rows + ranks - 1) / ranks; };
  for (int rank = 0; rank < ranks; ++rank) sizes.push_back(begin(rank + 1) - begin(rank));
  return BlocksOf(sizes);
}

Ownership Ownership::BlocksOf(const std::vector<Index>& sizes) {
  std::vector<Run> runs;
  Index begin = 0;
  for (std::size_t rank = 0; rank < sizes.size(); ++rank) {
    runs.push_back({begin, static_cast<int>(rank)});
    begin += sizes[rank];
  }
  return Ownership(runs, begin, static_cast<int>(sizes.size()));
}

const Ownership::LocalRun& Ownership::RunOf(Index row) const {
  const auto behind = std::upper_bound(runs_.begin(), runs_.end(), row,
                                       [](Index value, const LocalRun& run) { return value < run.begin; });
  return *std::prev(behind);
}

std::vector<Index> Ownership::rows(int rank) const {
  std::vector<Index> rows;
  rows.reserve(static_cast<std::size_t>(count(rank)));
  for (std::size_t k = 0; k < runs_.size(); ++k) {
    if (runs_[k].owner != rank) continue;
    const Index end = k + 1 < runs_.size() ? runs_[k + 1].begin : size();
    for (Index row = runs_[k].begin; row < end; ++row) rows.push_back(row);
  }
  return rows;
}

}  // namespace dlcs
