// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/mpi_team.h"

#include <algorithm>

#include "core/mpi/mpi_steps.h"

namespace dlcs {

MpiTeam::MpiTeam(MPI_Comm communicator) : communicator_(communicator) {
  MPI_Comm_rank(communicator_, &rank_);
  MPI_Comm_size(communicator_, &size_);
  steps_ = std::make_unique<MpiSteps>(*this);
}

void MpiTeam::Share(int owner, double* values, Index count) {
  constexpr Index kAtOnce = Index{1} << 27;  // counts of MPI are int
  for (Index begin = 0; begin < count; begin += kAtOnce) {
    MPI_Bcast(values + begin, static_cast<int>(std::min(kAtOnce, count - begin)), MPI_DOUBLE, owner, communicator_);
  }
}

std::vector<double> MpiTeam::Gather(double value) {
  std::vector<double> values(static_cast<std::size_t>(size_));
  MPI_Allgather(&value, 1, MPI_DOUBLE, values.data(), 1, MPI_DOUBLE, communicator_);
  return values;
}

}  // namespace dlcs
