// SPDX-License-Identifier: Apache-2.0
// Reads matrices from files, each rank its own rows.

#ifndef DLCS_CLIENT_MPI_ROW_FILES_H_
#define DLCS_CLIENT_MPI_ROW_FILES_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "core/mpi/distributed_operator.h"
#include "core/mpi/mpi_team.h"

namespace dlcs::client {

// Whether the file at `path` begins as a Matrix Market file of coordinates or as a sparse matrix of PETSc does, which
// are read by rows. Others, those that cannot be opened among them, are read whole.
bool IsReadByRows(const std::string& path);

// The matrix in such a file, in equal blocks of rows. Of PETSc's every rank reads its rows, of Matrix Market an equal
// share of the bytes, whose entries go to the ranks of their rows. Called by all ranks. Memory: some 30 bytes for each
// entry of this rank, and 12 in the end. No limit but that of 2³¹ - 1 rows and columns, and entries of one rank.
//
// Errors, the same on all ranks: InvalidArgument with file, place and rule, as ParseMatrixMarket() and ParsePetsc() say
// them, or if a position occurs twice; FailedPrecondition if the file cannot be read.
absl::StatusOr<std::shared_ptr<const DistributedOperator>> ReadByRows(const std::string& path, MpiTeam& team);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_MPI_ROW_FILES_H_
