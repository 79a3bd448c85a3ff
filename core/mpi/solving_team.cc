// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/solving_team.h"

#include "core/mpi/group_nodes.h"
#include "core/mpi/mpi_steps.h"

namespace dlcs {

struct SolvingTeam::Impl {
  MpiSteps steps;
  std::optional<GroupNodeSolvers> groups;
};

SolvingTeam::SolvingTeam(MPI_Comm communicator)
    : MpiTeam(communicator), impl_(new Impl{.steps = MpiSteps(*this), .groups = std::nullopt}) {}

SolvingTeam::~SolvingTeam() = default;

DistributedSteps* SolvingTeam::distributed_steps() { return &impl_->steps; }

NodeSolverGroups* SolvingTeam::node_solver_groups() { return impl_->groups ? &*impl_->groups : nullptr; }

void SolvingTeam::MakeGroups(int ranks_per_group) { impl_->groups.emplace(*this, ranks_per_group); }

MpiTeam* SolvingTeam::group() { return impl_->groups ? &impl_->groups->ranks().group() : nullptr; }

void SolvingTeam::KeepTrajectories() { impl_->steps.KeepTrajectories(); }

bool SolvingTeam::keeps_trajectories() const { return impl_->steps.keeps_trajectories(); }

std::optional<TrajectoryParts>& SolvingTeam::trajectory() { return impl_->steps.trajectory(); }

}  // namespace dlcs
