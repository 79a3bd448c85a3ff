// SPDX-License-Identifier: Apache-2.0
// Which rank has which rows.

#ifndef DLCS_CORE_MPI_OWNERSHIP_H_
#define DLCS_CORE_MPI_OWNERSHIP_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// Rows, or unknowns, by their owners; those of a rank keep their order. Kept as runs of neighbors with one owner, of
// which there are few, so that it takes little memory however many rows there are.
class Ownership {
 public:
  struct Run {
    Index begin = 0;  // until the next one begins
    int owner = 0;
    bool operator==(const Run&) const = default;
  };

  // `runs`: by their begins, the first one at 0.
  Ownership(const std::vector<Run>& runs, Index rows, int ranks);
  // Blocks of neighbors of sizes that differ by one at most.
  static Ownership Blocks(Index rows, int ranks);
  // Blocks of these sizes.
  static Ownership BlocksOf(const std::vector<Index>& sizes);

  Index size() const { return first_.back(); }
  int ranks() const { return static_cast<int>(first_.size()) - 1; }
  int owner(Index row) const { return RunOf(row).owner; }
  // The place of a row among those of its owner.
  Index local(Index row) const {
    const LocalRun& run = RunOf(row);
    return run.local + row - run.begin;
  }
  // Numbers that are consecutive in each rank: of its first row, and of any.
  Index first(int rank) const { return first_[static_cast<std::size_t>(rank)]; }
  Index number(Index row) const {
    const LocalRun& run = RunOf(row);
    return first(run.owner) + run.local + row - run.begin;
  }
  Index count(int rank) const { return first(rank + 1) - first(rank); }
  std::vector<Index> rows(int rank) const;

  bool operator==(const Ownership&) const = default;

 private:
  struct LocalRun {
    Index begin, local;
    int owner;
    bool operator==(const LocalRun&) const = default;
  };
  const LocalRun& RunOf(Index row) const;

  std::vector<LocalRun> runs_;
  std::vector<Index> first_;  // by rank; then the number of all rows
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_OWNERSHIP_H_
