// SPDX-License-Identifier: Apache-2.0
// Groups of ranks that share the nodes of a contour.

#ifndef DLCS_CORE_MPI_RANK_GROUPS_H_
#define DLCS_CORE_MPI_RANK_GROUPS_H_

#include <mpi.h>

#include <memory>

#include "core/mpi/mpi_team.h"

namespace dlcs {

// Ranks 0..G - 1 are the first group, the next G the second, and so on: neighbors are likely to be on one machine. A
// group has all rows of a matrix, and so have the peers of one rank, those with its place in other groups, the same
// rows.
class RankGroups {
 public:
  // `ranks_per_group` divides the number of ranks of `world`, which must outlive the groups. Called by all ranks.
  RankGroups(MpiTeam& world, int ranks_per_group);
  ~RankGroups();
  RankGroups(const RankGroups&) = delete;
  RankGroups& operator=(const RankGroups&) = delete;

  MpiTeam& world() { return world_; }
  MpiTeam& group() { return *group_; }  // of this rank
  MpiTeam& peers() { return *peers_; }  // whose rank there is the number of its group

 private:
  MpiTeam& world_;
  MPI_Comm group_ranks_ = MPI_COMM_NULL, peer_ranks_ = MPI_COMM_NULL;
  std::unique_ptr<MpiTeam> group_, peers_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_RANK_GROUPS_H_
