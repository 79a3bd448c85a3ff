// SPDX-License-Identifier: Apache-2.0
// A team of the ranks of an MPI communicator.

#ifndef DLCS_CORE_MPI_MPI_TEAM_H_
#define DLCS_CORE_MPI_MPI_TEAM_H_

#include <mpi.h>

#include <memory>
#include <vector>

#include "core/parallel/team.h"
#include "core/stepping/distributed_steps.h"

namespace dlcs {

class MpiTeam final : public Team {
 public:
  explicit MpiTeam(MPI_Comm communicator);

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  void Share(int owner, double* values, Index count) override;
  std::vector<double> Gather(double value) override;
  DistributedSteps* distributed_steps() override { return steps_.get(); }

  MPI_Comm communicator() const { return communicator_; }

 private:
  MPI_Comm communicator_;
  int rank_ = 0, size_ = 1;
  std::unique_ptr<DistributedSteps> steps_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_MPI_TEAM_H_
