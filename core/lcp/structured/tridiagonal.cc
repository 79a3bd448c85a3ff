// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/tridiagonal.h"

#include <cmath>
#include <cstdlib>

#include "core/matrix_classes/m_matrix.h"

namespace dlcs {
namespace {

// Where M(i, j) is kept; null for an entry that a tridiagonal matrix does not have.
double* EntryOf(Tridiagonal& M, Index i, Index j) {
  if (i == j) return &M.diagonal[i];
  if (i == j + 1) return &M.below[i];
  if (i + 1 == j) return &M.above[i];
  return nullptr;
}

}  // namespace

std::optional<Tridiagonal> TridiagonalOf(const Matrix& M) {
  Tridiagonal result(M.rows());
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      if (double* const entry = EntryOf(result, i, j)) {
        *entry = M(i, j);
      } else if (M(i, j) != 0) {
        return std::nullopt;
      }
    }
  }
  return result;
}

std::optional<Tridiagonal> TridiagonalOf(const Eigen::SparseMatrix<double>& M) {
  Tridiagonal result(M.rows());
  for (Index j = 0; j < M.cols(); ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(M, j); it; ++it) {
      if (double* const entry = EntryOf(result, it.row(), j)) {
        *entry = it.value();
      } else if (it.value() != 0) {
        return std::nullopt;
      }
    }
  }
  return result;
}

Matrix DenseOf(const Tridiagonal& M) {
  const Index n = M.size();
  Matrix dense = M.diagonal.asDiagonal();
  dense.diagonal(-1) = M.below.tail(n - 1);
  dense.diagonal(1) = M.above.head(n - 1);
  return dense;
}

bool IsClearlyMMatrix(const Tridiagonal& M) {
  double ratio = 0;  // above[i-1] over the pivot of i-1
  for (Index i = 0; i < M.size(); ++i) {
    if (!(M.below[i] <= 0) || !(M.above[i] <= 0)) return false;
    const double pivot = M.diagonal[i] - M.below[i] * ratio;
    if (!(pivot > kClearPivot * M.diagonal[i]) || !std::isfinite(1 / pivot)) return false;
    ratio = M.above[i] / pivot;
  }
  return true;
}

}  // namespace dlcs
