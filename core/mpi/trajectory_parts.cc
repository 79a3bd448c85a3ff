// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/trajectory_parts.h"

#include <mpi.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <vector>

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

// As many columns at once as make at most `most_values` in any rank, and one at least.
Index ColumnsAtOnce(const Ownership& rows, int ranks, Index most_values) {
  Index most_rows = 1;
  for (int rank = 0; rank < ranks; ++rank) most_rows = std::max(most_rows, rows.count(rank));
  return std::max<Index>(most_values / most_rows, 1);
}

// Whether the file, from the begin of its view on, has the bits of `part`. On all ranks.
bool HasBitsOf(const Matrix& part, MPI_File file, Index columns_at_once) {
  MPI_File_seek(file, 0, MPI_SEEK_SET);
  bool same = true;
  std::vector<double> found;
  for (Index k = 0; k < part.cols(); k += columns_at_once) {
    const Index count = std::min(columns_at_once, part.cols() - k) * part.rows();
    const auto size = static_cast<std::size_t>(count);
    found.assign(size, std::numeric_limits<double>::quiet_NaN());  // where nothing is read
    MPI_File_read_all(file, found.data(), static_cast<int>(count), MPI_DOUBLE, MPI_STATUS_IGNORE);
    if (size > 0) same = same && std::memcmp(found.data(), part.data() + k * part.rows(), size * sizeof(double)) == 0;
  }
  return same;
}

}  // namespace

std::string WriteTogether(const std::string& path, std::uint64_t begin, const Matrix& part, const Ownership& rows,
                          MpiTeam& team) {
  MPI_File file = MPI_FILE_NULL;
  int error = MPI_File_open(team.communicator(), path.c_str(), MPI_MODE_RDWR, MPI_INFO_NULL, &file);
  if (team.Any(error != MPI_SUCCESS)) {
    if (error == MPI_SUCCESS) MPI_File_close(&file);
    return team.FirstText(error == MPI_SUCCESS ? "" : TextOfError(error));
  }
  MPI_Datatype column = RowsInColumn(rows, team.rank());
  error = MPI_File_set_view(file, static_cast<MPI_Offset>(begin), MPI_DOUBLE, column, "native", MPI_INFO_NULL);
  // What any rank can count in bytes: counts of MPI are int.
  constexpr Index kMostValues = Index{1} << 27;
  const Index columns_at_once = ColumnsAtOnce(rows, team.size(), kMostValues);
  for (Index k = 0; k < part.cols(); k += columns_at_once) {
    const Index count = std::min(columns_at_once, part.cols() - k) * part.rows();
    const double* const values = part.data() + k * part.rows();
    const int written = MPI_File_write_all(file, values, static_cast<int>(count), MPI_DOUBLE, MPI_STATUS_IGNORE);
    if (error == MPI_SUCCESS) error = written;
  }
  const int synced = MPI_File_sync(file);
  if (error == MPI_SUCCESS) error = synced;
  // Open MPI reports success where the disk was full.
  constexpr Index kMostRead = Index{1} << 20;
  const bool is_there = HasBitsOf(part, file, ColumnsAtOnce(rows, team.size(), kMostRead));
  const int closed = MPI_File_close(&file);
  if (error == MPI_SUCCESS) error = closed;
  MPI_Type_free(&column);
  std::string what = is_there ? "" : "the file does not have what was written to it; is the disk full?";
  if (error != MPI_SUCCESS) what = TextOfError(error);
  return team.FirstText(what);
}

}  // namespace dlcs
