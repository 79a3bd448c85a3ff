// SPDX-License-Identifier: Apache-2.0
// A team of the ranks of an MPI communicator.

#ifndef DLCS_CORE_MPI_MPI_TEAM_H_
#define DLCS_CORE_MPI_MPI_TEAM_H_

#include <mpi.h>

#include <stop_token>
#include <string>
#include <vector>

#include "core/parallel/team.h"

namespace dlcs {

class MpiTeam : public Team {
 public:
  explicit MpiTeam(MPI_Comm communicator);

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  void Share(int owner, double* values, Index count) override;
  std::vector<double> Gather(double value) override;
  // A request to stop that all ranks see at the same place of their work: once `own` is requested in one of them, it is
  // in all, from the next Share() or Gather() on.
  std::stop_token Agreed(std::stop_token own);

  // The text of each rank, by rank, on the first one; none on others.
  std::vector<std::string> CollectTexts(const std::string& own);
  // The text of one rank, on all.
  std::string TextOf(int owner, std::string own);
  // That of the first rank whose text is not empty, on all.
  std::string FirstText(const std::string& own);

  MPI_Comm communicator() const { return communicator_; }

 private:
  MPI_Comm communicator_;
  int rank_ = 0, size_ = 1;
  std::stop_token wanted_;  // in this process
  std::stop_source agreed_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_MPI_TEAM_H_
