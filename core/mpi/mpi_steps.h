// SPDX-License-Identifier: Apache-2.0
// Iterative steps with states, pairs and active set distributed over the ranks.

#ifndef DLCS_CORE_MPI_MPI_STEPS_H_
#define DLCS_CORE_MPI_MPI_STEPS_H_

#include <optional>
#include <string>

#include "core/mpi/mpi_team.h"
#include "core/mpi/trajectory_parts.h"
#include "core/stepping/distributed_steps.h"

namespace dlcs {

// Every rank takes its own rows of the problem, which may be all that it has of it, and steps them with the code of one
// process, on a problem whose matrices are core/mpi/halo.h. What travels in a step are the values of neighbors, and
// sums and maxima of one number; states travel at the starts of smooth intervals, where an LCP of all pairs is solved
// by each rank, and those of output times at the end.
class MpiSteps final : public DistributedSteps {
 public:
  // `team` must outlive it.
  explicit MpiSteps(MpiTeam& team) : team_(team) {}

  std::string WhyNot(const Problem& problem) override;
  bool Take(SolveContext& context, SparseRule rule, IterativeAccount& account) override;

  // From now on trajectories stay with the ranks that have their rows: their solutions have times, and no rows in x, y
  // and w. For options that want them nowhere else.
  void KeepTrajectories() { keeps_trajectories_ = true; }
  bool keeps_trajectories() const { return keeps_trajectories_; }
  // The trajectory of the last solve that took such steps, if it was kept.
  std::optional<TrajectoryParts>& trajectory() { return trajectory_; }

 private:
  MpiTeam& team_;
  bool keeps_trajectories_ = false;
  std::optional<TrajectoryParts> trajectory_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_MPI_STEPS_H_
