// SPDX-License-Identifier: Apache-2.0
// Matrices whose rows are distributed over the ranks, and the values that their products need from other ranks.

#ifndef DLCS_CORE_MPI_HALO_H_
#define DLCS_CORE_MPI_HALO_H_

#include <vector>

#include "core/linalg/sparse/compressed_rows.h"
#include "core/linalg/sparse/row_writer.h"
#include "core/linalg/structured_matrix.h"
#include "core/mpi/mpi_team.h"
#include "core/mpi/ownership.h"

namespace dlcs {

// The unknowns of other ranks that rows of this one refer to, by rank and then by their order there.
class Halo {
 public:
  // `wanted`: these unknowns in any order, each any number of times. Called by all ranks at once.
  Halo(std::vector<Index> wanted, const Ownership& columns, MpiTeam& team);

  Index size() const { return static_cast<Index>(unknowns_.size()); }
  const std::vector<Index>& unknowns() const { return unknowns_; }
  // The place of an unknown in the halo.
  Index PlaceOf(Index unknown, const Ownership& columns) const;

  // Sets the rows of `outside` to those of the halo, where each rank has the rows of `own` for its unknowns.
  void Exchange(const Eigen::Ref<const Matrix>& own, Matrix& outside) const;

 private:
  struct Neighbor {
    int rank = 0;
    Index first = 0, count = 0;  // in the halo
    std::vector<int> sent;       // own unknowns that it needs
  };

  MpiTeam& team_;
  std::vector<Index> unknowns_;
  std::vector<Neighbor> neighbors_;  // by rank
};

// The rows of this rank of a matrix, apart by its own columns and those of the halo.
struct DistributedRows {
  // `rows` has all columns. Called by all ranks at once.
  DistributedRows(const RowMajorMatrix& rows, const Ownership& columns, MpiTeam& team);

  RowMajorMatrix own, outside;
  Halo halo;
};

class DistributedMatrix final : public LinearOperator {
 public:
  DistributedMatrix(const RowMajorMatrix& rows, const Ownership& columns, MpiTeam& team) : rows_(rows, columns, team) {}

  Index rows() const override { return rows_.own.rows(); }
  Index cols() const override { return rows_.own.cols(); }
  Index nonzeros() const override { return rows_.own.nonZeros() + rows_.outside.nonZeros(); }
  void Multiply(const Eigen::Ref<const Matrix>& right, Eigen::Ref<Matrix> left) const override;
  Vector AbsTimes(const Eigen::Ref<const Vector>& v) const override;

  // The rows with all columns. `columns`: those that it was made of, of which this rank owns `own_columns`.
  RowMajorMatrix Rows(const Ownership& columns, const std::vector<Index>& own_columns) const;

 private:
  DistributedRows rows_;
};

CompressedRows<double> Compressed(const RowMajorMatrix& matrix);

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_HALO_H_
