// SPDX-License-Identifier: Apache-2.0
// Elimination in principal submatrices of a banded M-matrix, kept from one to the next.

#ifndef DLCS_CORE_LCP_STRUCTURED_BAND_FACTOR_H_
#define DLCS_CORE_LCP_STRUCTURED_BAND_FACTOR_H_

#include <memory>
#include <vector>

#include "core/lcp/basis/lcp_solver.h"
#include "core/lcp/structured/band_matrix.h"
#include "core/linalg/simd/blocked_lanes.h"

namespace dlcs {

// Factors (L + D) D⁻¹ (D + U) of M_SS by blocks of 8 × 8, D block diagonal, without exchanges, for a band matrix M that
// is clearly an M-matrix: then so is every M_SS, and pivots need no tests. Rows and columns of indices outside S are
// those of the identity, so blocks before the first index that entered or left S keep their factors. After such an
// index the change decays: once as many consecutive rows of blocks as the band is wide are unchanged, the later ones
// are kept up to the next such index. The bits are those of a new factorization. Cost: 2 b² for each row that is
// factored again, 4 n b for a solve, with b entries on each side of the diagonal, rounded up to whole blocks.
class BandFactor {
 public:
  explicit BandFactor(std::shared_ptr<const BandMatrix> M);

  // Factors M_SS; replaces the factors of the S before.
  void Factor(const Basis& basis);
  // x_S := M_SS⁻¹ x_S; x must be zero outside S.
  void Solve(Vector& x);

  // Whether no entry of `M` off the diagonal is positive, and all pivots of its elimination are above 1e-7 of their
  // diagonal entries.
  static bool IsClearlyMMatrix(const BandMatrix& M);

 private:
  static constexpr Index kSize = EightBlock::kSize;

  // The blocks (row, row + d) for -reach <= d <= reach, at [d].
  EightBlock* Row(std::vector<EightBlock>& blocks, Index row) { return &blocks[row * (2 * reach_ + 1) + reach_]; }
  // Factors a row of blocks; returns whether S and the factors in it are unchanged.
  bool FactorRow(const Basis& basis, Index row);

  std::shared_ptr<const BandMatrix> M_;
  Index num_rows_;  // of blocks
  Index reach_;     // blocks beside the diagonal
  std::vector<EightBlock> of_M_;
  std::vector<EightBlock> factors_;    // L, D⁻¹ and U
  std::vector<EightBlock> former_;     // D⁻¹ and U of one row
  Basis basis_;                        // of the factors
  std::vector<std::uint8_t> is_used_;  // whether S has indices of a row of blocks
  bool is_empty_ = true;
  Vector is_basic_;  // 1 in S, otherwise 0; with x and the pivots as long as all blocks are
  Vector pivots_, x_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_BAND_FACTOR_H_
