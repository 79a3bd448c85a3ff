// SPDX-License-Identifier: Apache-2.0
// Brings entries of matrices to the ranks that have their rows.

#ifndef DLCS_CORE_MPI_ROW_EXCHANGE_H_
#define DLCS_CORE_MPI_ROW_EXCHANGE_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/linalg/sparse/row_writer.h"
#include "core/linalg/structured_matrix.h"
#include "core/mpi/mpi_team.h"
#include "core/mpi/ownership.h"

namespace dlcs {

class RowExchange {
 public:
  RowExchange(const Ownership& rows, Index columns, MpiTeam& team);

  // Of any row. Kept until Send(), which should follow when IsFull().
  void Add(Index row, Index column, double value);
  bool IsFull() const { return to_send_.size() >= kAtOnce; }
  // Called by all ranks as often, with entries or without.
  void Send();
  // Called by all ranks after the last Send(). The rows of this rank in their order, columns increasing, entries at the
  // same place in the order of ranks and of Add(). Errors: std::length_error if a rank gets more entries than an index
  // of a matrix counts, 2³¹ - 1; then on all ranks.
  RowMajorMatrix Finish();

 private:
  // Columns of matrices in memory are numbers of 32 bits.
  struct Entry {
    std::int32_t row, column;
    double value;
  };
  // 2 MB, of which a rank gets as many as there are ranks.
  static constexpr std::size_t kAtOnce = std::size_t{1} << 17;

  const Ownership& rows_;
  const Index columns_;
  MpiTeam& team_;
  std::vector<Entry> to_send_;
  std::vector<std::vector<Entry>> received_;  // of each Send(), in the order of ranks
};

// The rows of this rank of a matrix, by the whole of it or by its rows in other ranks; columns are all. Called by all
// ranks. Cost: the entries of the whole where every rank has them; of a Kronecker sum those of these rows.
RowMajorMatrix RowsOf(const StructuredMatrix& matrix, const Ownership& rows, MpiTeam& team);

// The rows of this rank of the transpose of a matrix of which it has the rows `numbers`.
RowMajorMatrix Transposed(const RowMajorMatrix& matrix, const std::vector<Index>& numbers, Index rows,
                          const Ownership& columns, MpiTeam& team);

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_ROW_EXCHANGE_H_
