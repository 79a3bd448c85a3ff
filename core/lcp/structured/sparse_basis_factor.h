// SPDX-License-Identifier: Apache-2.0
// A factorization of the principal submatrix M_SS of a basis S of a sparse matrix.

#ifndef DLCS_CORE_LCP_STRUCTURED_SPARSE_BASIS_FACTOR_H_
#define DLCS_CORE_LCP_STRUCTURED_SPARSE_BASIS_FACTOR_H_

#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <vector>

#include "core/lcp/basis/lcp_solver.h"
#include "core/linalg/structured_matrix.h"

namespace dlcs {

// LDLᵀ factors of M_SS for a symmetric M, LU factors with row exchanges for others; computed when S changes
// and kept while it does not. They depend on M and S alone. M_SS is all that is factored: a small basis of a
// large matrix is cheap.
class SparseBasisFactor {
 public:
  explicit SparseBasisFactor(Index n) : position_(n, -1) {}

  // Factors M_SS for S = { i : basis[i] }, or recalls that this was done. `M` is the same in all calls, and
  // `symmetric` tells whether it is; its order should keep the fill of LDLᵀ small. False when M_SS is
  // singular: what is nearly so shows in the residual of Solve().
  bool Factor(const SparseMatrix& M, bool symmetric, const Basis& basis);

  const std::vector<Index>& indices() const { return indices_; }  // S, increasing

  // M_SS⁻¹ b, entries in the order of indices(). After a Factor() that returned true.
  Vector Solve(const Vector& b) const;

 private:
  SparseMatrix Submatrix(const SparseMatrix& M, bool lower_only);

  bool factored_ = false;  // basis_, indices_ and usable_ mean something
  bool usable_ = false;
  bool symmetric_ = false;
  Basis basis_;
  std::vector<Index> indices_;
  std::vector<int> position_;  // of an index in S
  Eigen::SimplicialLDLT<SparseMatrix, Eigen::Lower, Eigen::NaturalOrdering<int>> ldlt_;
  Eigen::SparseLU<SparseMatrix, Eigen::COLAMDOrdering<int>> lu_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_SPARSE_BASIS_FACTOR_H_
