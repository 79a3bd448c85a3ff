// SPDX-License-Identifier: Apache-2.0
// A trajectory of which every rank has its rows, and a file that ranks write together.

#ifndef DLCS_CORE_MPI_TRAJECTORY_PARTS_H_
#define DLCS_CORE_MPI_TRAJECTORY_PARTS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "core/mpi/mpi_team.h"
#include "core/mpi/ownership.h"
#include "core/problem/solution.h"

namespace dlcs {

// x, y and w at the output times: rows of this rank, a column for each time. Left limits are those of all rows.
struct TrajectoryParts {
  Ownership states, pairs;
  Matrix x, y, w;
  std::vector<LeftLimit> left_limits;
};

// Writes a matrix of which every rank has the `rows`, as numbers of 64 bits that begin at byte `begin` of the file at
// `path`, column by column. Called by all ranks; the file exists and all see it. Reads what is written again, since
// Open MPI ignores writes that fail. Returns an error's text, the same on all; empty if there is none. Cost: a copy of
// a gigabyte at most beside the part.
std::string WriteTogether(const std::string& path, std::uint64_t begin, const Matrix& part, const Ownership& rows,
                          MpiTeam& team);

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_TRAJECTORY_PARTS_H_
