// SPDX-License-Identifier: Apache-2.0
// The signs of all principal minors of a matrix, as far as arithmetic can tell.

#ifndef DLCS_CORE_MATRIX_CLASSES_PRINCIPAL_MINORS_H_
#define DLCS_CORE_MATRIX_CLASSES_PRINCIPAL_MINORS_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/types.h"

namespace dlcs {

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
