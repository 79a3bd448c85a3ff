// SPDX-License-Identifier: Apache-2.0
// Balances a square matrix: block triangular form, and scaling that makes rows and columns similar in size.

#ifndef DLCS_CORE_LINALG_BALANCE_H_
#define DLCS_CORE_LINALG_BALANCE_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// matrix(k, l) = 2^{exponents[l] - exponents[k]} A(order[k], order[l]), so that x[order[k]] = 2^{exponents[k]} z[k]
// makes x' = A x to z' = matrix z. Block upper triangular; the states inside a block depend on each other.
struct BalancedMatrix {
  Matrix matrix;
  std::vector<Index> order;
  std::vector<int> exponents;
  std::vector<Index> begins;  // block b is [begins[b], begins[b + 1]); one more than there are blocks

  Index num_blocks() const { return static_cast<Index>(begins.size()) - 1; }
  Index size_of_block(Index b) const { return begins[b + 1] - begins[b]; }
};

// Sorts the states of `A` into blocks by its nonzero entries, scales each block until no power of two for one state
// makes rows and columns smaller together [Parlett & Reinsch 1969], sorts its states by falling size of row, and scales
// the blocks so that no coupling is larger than the blocks that it couples.
//
// Only powers of two multiply, so nothing is rounded (but what underflows). Changing the units of states by powers of
// two does not change a block: the result is the same to the bit if the order is the same. Changing the unit of time
// only multiplies the matrix. Entries that are not finite: no scaling. Cost: some twenty passes over the entries, and
// 2/3 k³ operations for a block of k states. Source: [Parlett & Reinsch 1969] Balancing a matrix for calculation of
// eigenvalues and eigenvectors. Numer. Math. 13.
BalancedMatrix Balance(const Matrix& A);

// Another matrix of the same states, in the order and units of `balanced`; and back.
Matrix InUnitsOf(const BalancedMatrix& balanced, const Matrix& given);
Matrix InGivenUnits(const Matrix& matrix, const BalancedMatrix& balanced);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_BALANCE_H_
