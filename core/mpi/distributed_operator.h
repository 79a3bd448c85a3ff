// SPDX-License-Identifier: Apache-2.0
// A matrix of a whole problem of which every rank has some rows.

#ifndef DLCS_CORE_MPI_DISTRIBUTED_OPERATOR_H_
#define DLCS_CORE_MPI_DISTRIBUTED_OPERATOR_H_

#include "core/linalg/sparse/row_writer.h"
#include "core/linalg/structured_matrix.h"
#include "core/mpi/mpi_team.h"
#include "core/mpi/ownership.h"

namespace dlcs {

// For what is decided before steps are taken: vectors are whole in each rank, and so are products. All ranks call the
// same functions. Entries() brings the whole matrix to each of them.
class DistributedOperator final : public LinearOperator {
 public:
  // `rows`: those of this rank, with all columns.
  DistributedOperator(RowMajorMatrix rows, Ownership ownership, MpiTeam& team);

  Index rows() const override { return ownership_.size(); }
  Index cols() const override { return own_.cols(); }
  Index nonzeros() const override { return nonzeros_; }
  void Multiply(const Eigen::Ref<const Matrix>& right, Eigen::Ref<Matrix> left) const override;
  Vector AbsTimes(const Eigen::Ref<const Vector>& v) const override;
  SparseMatrix Entries() const override;

  const RowMajorMatrix& own() const { return own_; }
  const Ownership& ownership() const { return ownership_; }

 private:
  RowMajorMatrix own_;
  Ownership ownership_;
  MpiTeam& team_;
  Index nonzeros_ = 0;  // of all ranks
};

// Rows of all ranks from those of each, in all of them.
Matrix Collect(const Matrix& part, const Ownership& rows, MpiTeam& team);

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_DISTRIBUTED_OPERATOR_H_
