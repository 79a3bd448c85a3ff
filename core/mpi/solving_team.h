// SPDX-License-Identifier: Apache-2.0
// The team of all ranks, with the parts of a solve that are distributed over it.

#ifndef DLCS_CORE_MPI_SOLVING_TEAM_H_
#define DLCS_CORE_MPI_SOLVING_TEAM_H_

#include <mpi.h>

#include <memory>
#include <optional>

#include "core/mpi/mpi_team.h"
#include "core/mpi/trajectory_parts.h"

namespace dlcs {

class SolvingTeam final : public MpiTeam {
 public:
  explicit SolvingTeam(MPI_Comm communicator);
  ~SolvingTeam() override;

  DistributedSteps* distributed_steps() override;
  NodeSolverGroups* node_solver_groups() override;

  // From now on groups of so many ranks, more than one, share the nodes of contours (core/mpi/rank_groups.h). It
  // divides the number of ranks. Called by all ranks.
  void MakeGroups(int ranks_per_group);
  // The group of this rank; null without MakeGroups().
  MpiTeam* group();

  // From now on trajectories of distributed steps stay with the ranks that have their rows: their solutions have times,
  // and no rows in x, y and w. For options that want them nowhere else.
  void KeepTrajectories();
  bool keeps_trajectories() const;
  // The trajectory of the last solve, if that was one of distributed steps and it was kept.
  std::optional<TrajectoryParts>& trajectory();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_SOLVING_TEAM_H_
