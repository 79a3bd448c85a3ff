// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/multigrid_solver.h"

namespace dlcs {
namespace {

using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// K by rows, with zeros where only Kᵀ has an entry, and on the diagonal.
CompressedRows<double> WithSymmetricPattern(const SparseMatrix& K) {
  RowMajor rows = K;
  RowMajor identity(K.rows(), K.cols());
  identity.setIdentity();
  rows = RowMajor(rows + 0.0 * RowMajor(K.transpose())) + 0.0 * identity;
  rows.makeCompressed();
  CompressedRows<double> result{.cols = K.cols()};
  result.start.assign(rows.outerIndexPtr(), rows.outerIndexPtr() + rows.rows() + 1);
  result.column.assign(rows.innerIndexPtr(), rows.innerIndexPtr() + rows.nonZeros());
  result.value.assign(rows.valuePtr(), rows.valuePtr() + rows.nonZeros());
  return result;
}

}  // namespace

MultigridSolver::MultigridSolver(const SparseMatrix& K, Workers& workers)
    : KrylovSolver(WithSymmetricPattern(K), IsSymmetric(K), workers, Team::Alone()) {
  if (!TryDiagonal()) multigrid_.emplace(K_, workers);
}

}  // namespace dlcs
