// SPDX-License-Identifier: Apache-2.0
// A team of the ranks of an MPI communicator.

#ifndef DLCS_CORE_MPI_MPI_TEAM_H_
#define DLCS_CORE_MPI_MPI_TEAM_H_

#include <mpi.h>

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/mpi/trajectory_parts.h"
#include "core/parallel/team.h"

namespace dlcs {

class RankGroups;

class MpiTeam final : public Team {
 public:
  explicit MpiTeam(MPI_Comm communicator);
  ~MpiTeam() override;

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  void Share(int owner, double* values, Index count) override;
  std::vector<double> Gather(double value) override;
  // A request to stop that all ranks see at the same place of their work: once `own` is requested in one of them, it is
  // in all, from the next Share() or Gather() on.
  std::stop_token Agreed(std::stop_token own);
  DistributedSteps* distributed_steps() override { return steps_.get(); }
  NodeSolverGroups* node_solver_groups() override;

  // From now on groups of so many ranks, more than one, share the nodes of contours (core/mpi/rank_groups.h). It
  // divides the number of ranks. Called by all ranks.
  void MakeGroups(int ranks_per_group);
  // That of this rank; null without MakeGroups().
  MpiTeam* group();

  // The text of each rank, by rank, on the first one; none on others.
  std::vector<std::string> CollectTexts(const std::string& own);
  // The text of one rank, on all.
  std::string TextOf(int owner, std::string own);
  // That of the first rank whose text is not empty, on all.
  std::string FirstText(const std::string& own);

  // From now on trajectories of distributed steps stay with the ranks that have their rows: their solutions have times,
  // and no rows in x, y and w. For options that want them nowhere else.
  void KeepTrajectories() { keeps_trajectories_ = true; }
  bool keeps_trajectories() const { return keeps_trajectories_; }
  // Of the last solve, if it was one of distributed steps.
  std::optional<TrajectoryParts>& trajectory() { return trajectory_; }

  MPI_Comm communicator() const { return communicator_; }

 private:
  MPI_Comm communicator_;
  int rank_ = 0, size_ = 1;
  std::stop_token wanted_;  // in this process
  std::stop_source agreed_;
  std::unique_ptr<DistributedSteps> steps_;
  std::unique_ptr<RankGroups> groups_;
  bool keeps_trajectories_ = false;
  std::optional<TrajectoryParts> trajectory_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_MPI_TEAM_H_
