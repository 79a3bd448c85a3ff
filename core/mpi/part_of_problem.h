// SPDX-License-Identifier: Apache-2.0
// The rows of a problem that one rank has.

#ifndef DLCS_CORE_MPI_PART_OF_PROBLEM_H_
#define DLCS_CORE_MPI_PART_OF_PROBLEM_H_

#include <memory>
#include <vector>

#include "core/mpi/halo.h"
#include "core/mpi/mpi_team.h"
#include "core/mpi/ownership.h"
#include "core/problem/problem.h"
#include "core/stepping/iterative_system.h"

namespace dlcs {

// These components of a function.
TimeFunction ComponentsOf(const TimeFunction& function, const std::vector<Index>& rows);

// A pair goes with the first state that it is about, so that an obstacle is where its state is. Called by all ranks.
Ownership PairsByStates(const Problem& problem, const Ownership& states, MpiTeam& team);

// The matrices of the pairs of this rank. Called by all ranks.
RowsOfPairs PairsOfRank(const Problem& problem, const Ownership& states, const Ownership& pairs, MpiTeam& team);

// The states and pairs of this rank, with distributed matrices.
class PartOfProblem {
 public:
  // Called by all ranks. Memory: that of these rows, and of vectors and functions of `whole`.
  PartOfProblem(const Problem& whole, const Ownership& states, const Ownership& pairs, MpiTeam& team);

  // Break points are those of the whole problem.
  const Problem& problem() const { return problem_; }

  // The matrices once more by all of their columns.
  RowsOfStates States() const;
  const RowsOfPairs& pairs() const { return rows_of_pairs_; }

 private:
  const Ownership &states_, &pairs_;
  std::vector<Index> own_states_, own_pairs_;
  std::shared_ptr<const DistributedMatrix> A_, B_, E_;  // no E_ without a mass matrix
  RowsOfPairs rows_of_pairs_;
  Problem problem_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_PART_OF_PROBLEM_H_
