// SPDX-License-Identifier: Apache-2.0
// A tridiagonal matrix by its three diagonals.

#ifndef DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_H_
#define DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_H_

#include <Eigen/SparseCore>
#include <optional>

#include "core/types.h"

namespace dlcs {

// M(i, i-1) = below[i], M(i, i) = diagonal[i], M(i, i+1) = above[i]; below[0] = above[n-1] = 0.
struct Tridiagonal {
  Tridiagonal() = default;
  explicit Tridiagonal(Index n) : below(Vector::Zero(n)), diagonal(Vector::Zero(n)), above(Vector::Zero(n)) {}

  Index size() const { return diagonal.size(); }

  Vector below, diagonal, above;
};

// The diagonals of a square matrix; absent if it has other nonzero entries.
std::optional<Tridiagonal> TridiagonalOf(const Matrix& M);
std::optional<Tridiagonal> TridiagonalOf(const Eigen::SparseMatrix<double>& M);

Matrix DenseOf(const Tridiagonal& M);

// Whether `M` is a nonsingular M-matrix whose elimination loses few digits: no off-diagonal entry is positive, and all
// pivots are above 1e-7 of the diagonal entry. Then the same holds for every M_SS (the Schur complement of an index
// decreases as more indices are eliminated before it), so pivots need no tests.
bool IsClearlyMMatrix(const Tridiagonal& M);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_H_
