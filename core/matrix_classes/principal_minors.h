// SPDX-License-Identifier: Apache-2.0
// The signs of all principal minors of a matrix, with rounding taken into account.

#ifndef DLCS_CORE_MATRIX_CLASSES_PRINCIPAL_MINORS_H_
#define DLCS_CORE_MATRIX_CLASSES_PRINCIPAL_MINORS_H_

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/linalg/bounded_sum.h"
#include "core/types.h"

namespace dlcs {

// Entries and bounds of their absolute errors, carried to first order. An operation counts as two, which
// leaves room for the terms of second order as long as pivots are clear.
struct TrackedMatrix {
  Matrix value;
  Matrix error;

  // The matrix with exact entries, and the matrix whose entries carry rounding errors already.
  static TrackedMatrix Exactly(const Matrix& M) { return {M, Matrix::Zero(M.rows(), M.cols())}; }
  static TrackedMatrix Rounded(const Matrix& M) { return {M, RoundingOf(2) * M.cwiseAbs()}; }

  bool PivotIsPositive() const { return value(0, 0) > error(0, 0); }

  // Whether the first diagonal entry is known well enough to divide by it.
  bool PivotIsClear() const { return std::abs(value(0, 0)) > 1e6 * error(0, 0); }

  // The Schur complement of the first diagonal entry.
  void EliminateInto(TrackedMatrix& schur) const {
    const Index size = value.rows() - 1;
    const double pivot = value(0, 0);
    const double pivot_error = error(0, 0) / std::abs(pivot) + RoundingOf(4);
    for (Index j = 0; j < size; ++j) {
      const double up = value(0, j + 1) / pivot;
      const double up_error = error(0, j + 1) / std::abs(pivot);
      for (Index i = 0; i < size; ++i) {
        const double left = value(i + 1, 0);
        const double product = left * up;
        const double entry = value(i + 1, j + 1) - product;
        schur.value(i, j) = entry;
        schur.error(i, j) = error(i + 1, j + 1) + std::abs(left) * up_error + error(i + 1, 0) * std::abs(up) +
                            std::abs(product) * pivot_error + RoundingOf(2) * std::abs(entry);
      }
    }
  }

  // The rest without the first row and column.
  void DropInto(TrackedMatrix& rest) const {
    const Index size = value.rows() - 1;
    rest.value = value.bottomRightCorner(size, size);
    rest.error = error.bottomRightCorner(size, size);
  }
};

// The principal minor det M_SS, and what is known of its sign: -1, 0, 1, or absent where rounding could
// decide.
struct PrincipalMinor {
  std::uint32_t subset = 0;  // bit i is set when i is in S
  Index order = 0;           // |S|
  double value = 0;
  std::optional<int> sign;
};

// The members of `subset`, increasing.
std::vector<Index> IndicesOf(std::uint32_t subset);

// The determinant of the square matrix `M` (n >= 1) by elimination with complete pivoting and a running error
// bound. Where the bound does not tell the sign and the entries are short (integers times powers of two for
// rows and columns, with Hadamard's bound below 2^62), by Bareiss' fraction-free elimination, which is exact.
// `M` is taken as it stands: its entries carry no error. `subset` is left 0. O(n³).
PrincipalMinor Determinant(const Matrix& M);

// The determinant as a number that is not rounded, where the entries are short as above and it has at most 53
// bits; absent otherwise.
std::optional<double> ExactDeterminant(const Matrix& M);

// Calls `visit` for every one of the 2ⁿ - 1 principal minors of `M` (n <= 20) until it returns false. Schur
// complements give all of them for O(2ⁿ) work where the pivots are clear [Griffin & Tsatsomeros 2006]; where
// one is not, the minors that need it are computed one by one.
void VisitPrincipalMinors(const Matrix& M, const std::function<bool(const PrincipalMinor&)>& visit);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_PRINCIPAL_MINORS_H_
