// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/rank_groups.h"

namespace dlcs {

RankGroups::RankGroups(MpiTeam& world, int ranks_per_group) : world_(world) {
  const int rank = world.rank();
  MPI_Comm_split(world.communicator(), rank / ranks_per_group, rank, &group_ranks_);
  MPI_Comm_split(world.communicator(), rank % ranks_per_group, rank, &peer_ranks_);
  group_ = std::make_unique<MpiTeam>(group_ranks_);
  peers_ = std::make_unique<MpiTeam>(peer_ranks_);
}

RankGroups::~RankGroups() {
  peers_.reset();
  group_.reset();
  MPI_Comm_free(&peer_ranks_);
  MPI_Comm_free(&group_ranks_);
}

}  // namespace dlcs
