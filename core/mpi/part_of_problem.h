// SPDX-License-Identifier: Apache-2.0
// The rows of a problem that one rank has.

#ifndef DLCS_CORE_MPI_PART_OF_PROBLEM_H_
#define DLCS_CORE_MPI_PART_OF_PROBLEM_H_

#include <vector>

#include "core/mpi/mpi_team.h"
#include "core/mpi/ownership.h"
#include "core/problem/problem.h"

namespace dlcs {

// These components of a function.
TimeFunction ComponentsOf(const TimeFunction& function, const std::vector<Index>& rows);

// The states and pairs of this rank, with distributed matrices. Break points are those of the whole problem.
Problem PartOf(const Problem& problem, const Ownership& states, const Ownership& pairs, MpiTeam& team);

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_PART_OF_PROBLEM_H_
