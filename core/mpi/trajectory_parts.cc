// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/trajectory_parts.h"

#include <mpi.h>

#include <algorithm>

#include "core/mpi/mpi_team.h"

namespace dlcs {
namespace {

// The rows of this rank in a column of the file, as runs.
MPI_Datatype RowsInColumn(const Ownership& rows, int rank) {
  std::vector<int> lengths;
  std::vector<MPI_Aint> begins;  // in bytes
  Index next = -1;
  for (const Index row : rows.rows(rank)) {
    if (row == next) {
      ++lengths.back();
    } else {
      lengths.push_back(1);
      begins.push_back(static_cast<MPI_Aint>(row) * static_cast<MPI_Aint>(sizeof(double)));
    }
    next = row + 1;
  }
  MPI_Datatype runs = MPI_DATATYPE_NULL, column = MPI_DATATYPE_NULL;
  MPI_Type_create_hindexed(static_cast<int>(lengths.size()), lengths.data(), begins.data(), MPI_DOUBLE, &runs);
  MPI_Type_create_resized(runs, 0, static_cast<MPI_Aint>(rows.size()) * static_cast<MPI_Aint>(sizeof(double)), &column);
  MPI_Type_free(&runs);
  MPI_Type_commit(&column);
  return column;
}

std::string TextOfError(int code) {
  std::string text(MPI_MAX_ERROR_STRING, '\0');
  int length = 0;
  MPI_Error_string(code, text.data(), &length);
  text.resize(static_cast<std::size_t>(length));
  return text;
}

}  // namespace

std::string WriteTogether(const std::string& path, std::uint64_t begin, const Matrix& part, const Ownership& rows,
                          MpiTeam& team) {
  MPI_File file = MPI_FILE_NULL;
  int error = MPI_File_open(team.communicator(), path.c_str(), MPI_MODE_WRONLY, MPI_INFO_NULL, &file);
  if (team.Any(error != MPI_SUCCESS)) {
    if (error == MPI_SUCCESS) MPI_File_close(&file);
    return team.FirstText(error == MPI_SUCCESS ? "" : TextOfError(error));
  }
  MPI_Datatype column = RowsInColumn(rows, team.rank());
  error = MPI_File_set_view(file, static_cast<MPI_Offset>(begin), MPI_DOUBLE, column, "native", MPI_INFO_NULL);
  // As many columns at once as any rank can count in bytes: counts of MPI are int.
  constexpr Index kAtOnce = Index{1} << 27;
  Index most_rows = 1;
  for (int rank = 0; rank < team.size(); ++rank) most_rows = std::max(most_rows, rows.count(rank));
  const Index columns_at_once = std::max<Index>(kAtOnce / most_rows, 1);
  for (Index k = 0; k < part.cols(); k += columns_at_once) {
    const Index count = std::min(columns_at_once, part.cols() - k) * part.rows();
    const double* const values = part.data() + k * part.rows();
    const int written = MPI_File_write_all(file, values, static_cast<int>(count), MPI_DOUBLE, MPI_STATUS_IGNORE);
    if (error == MPI_SUCCESS) error = written;
  }
  const int closed = MPI_File_close(&file);
  if (error == MPI_SUCCESS) error = closed;
  MPI_Type_free(&column);
  return team.FirstText(error == MPI_SUCCESS ? "" : TextOfError(error));
}

}  // namespace dlcs
