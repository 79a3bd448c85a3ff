// SPDX-License-Identifier: Apache-2.0
// A factorization of the principal submatrix M_SS of a basis S.

#ifndef DLCS_CORE_LCP_BASIS_BASIS_FACTOR_H_
#define DLCS_CORE_LCP_BASIS_BASIS_FACTOR_H_

#include <vector>

#include "core/lcp/basis/lcp_solver.h"
#include "core/matrix_classes/m_matrix.h"
#include "core/types.h"

namespace dlcs {

// How M_SS may be eliminated.
enum class Elimination {
  kPivoting,  // any M: rows are exchanged, M_SS must be nonsingular
  kMMatrix,   // M a Z-matrix: no exchanges, in the band of M, and M_SS must be a nonsingular M-matrix
};

// LU factors of M_SS, computed when S changes and kept while it does not. They depend on M and S alone.
class BasisFactor {
 public:
  BasisFactor(const Matrix& M, Elimination elimination);
  BasisFactor(const BasisFactor& other);  // for the same matrix; the factors are not copied

  // Factors M_SS for S = { i : basis[i] }, or recalls that this was done. `M` is the matrix of the constructor. False
  // when M_SS is singular to working precision (kPivoting) or not a nonsingular M-matrix (kMMatrix). Always true for
  // the empty basis. Allocates only if a doubtful pivot of an M-matrix needs a closer test.
  bool Factor(const Matrix& M, const Basis& basis);

  // S in increasing order.
  const std::vector<Index>& indices() const { return indices_; }

  // x := M_SS⁻¹ x, entries in the order of indices(). After a Factor() that returned true.
  void Solve(Eigen::Ref<Vector> x);

 private:
  bool Eliminate(Index size);
  bool PivotsAreClear(Index size) const;

  Elimination elimination_;
  bool factored_ = false;  // basis_, indices_ and usable_ mean something
  bool usable_ = false;
  Basis basis_;
  std::vector<Index> indices_;
  MMatrixFactor m_matrix_;     // with kMMatrix
  Matrix lu_;                  // with kPivoting: factors of the rows in the order source_
  Vector inverse_;             // ... and 1 over the pivots
  std::vector<Index> source_;  // row p of the factors is row source_[p] of M_SS
  Vector permuted_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BASIS_BASIS_FACTOR_H_
