// SPDX-License-Identifier: Apache-2.0
// Elimination in principal submatrices of a banded M-matrix, kept from one to the next.

#ifndef DLCS_CORE_LCP_BAND_FACTOR_H_
#define DLCS_CORE_LCP_BAND_FACTOR_H_

#include <memory>
#include <vector>

#include "core/lcp/band_matrix.h"
#include "core/lcp/lcp.h"

namespace dlcs {

// LDU factors of M_SS without row exchanges, for a band matrix M that is clearly an M-matrix: then so is every M_SS,
// and nothing has to be looked at while bases are factored. Rows and columns beside S are left out where they stand, so
// that the rows before an index that has changed sides keep their factors. Behind it the change dies away: where b rows of
// U in turn come out as they were, those behind them keep theirs up to the next such index. All have the bits of fresh
// ones. Cost: b² for each of the others, 4 n b a solve.
class BandFactor {
 public:
  explicit BandFactor(std::shared_ptr<const BandMatrix> M);

  // Factors M_SS; forgets the S before.
  void Factor(const Basis& basis);
  // x_S := M_SS⁻¹ x_S; x must be zero beside S.
  void Solve(Vector& x);

  // Whether no entry of `M` off the diagonal is positive, and all pivots of its elimination are above 1e-7 of their
  // diagonal entries.
  static bool IsClearlyMMatrix(const BandMatrix& M);

 private:
  // Row i of U behind the diagonal.
  const double* Upper(Index i) const { return rows_.data() + i * (2 * b_ + 1) + b_ + 1; }
  // The rows from `first` up to `end` of M_SS, and their factors.
  void Load(const Basis& basis, Index first, Index end);
  void Eliminate(const Basis& basis, Index first, Index end);
  // Keeps the b rows of U before `end`, but for those before `first`; tells later whether they have become others.
  void KeepBefore(Index first, Index end);
  bool AgreesBefore(const Basis& basis, Index first, Index end) const;

  std::shared_ptr<const BandMatrix> M_;
  Basis basis_;  // of the factors
  bool is_empty_ = true;
  Index b_;                      // the bandwidth of M, or the next multiple of eight
  std::vector<double> rows_;     // as in BandMatrix: L D below the diagonal, U - I above it, of no account on it
  std::vector<double> scratch_;  // a row of U
  std::vector<double> inverse_;  // of D
  std::vector<double> padded_;   // x between zeros
  std::vector<double> former_;   // b rows of U as they were
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BAND_FACTOR_H_
