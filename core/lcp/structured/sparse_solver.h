// SPDX-License-Identifier: Apache-2.0
// LCPs with a large sparse matrix.

#ifndef DLCS_CORE_LCP_STRUCTURED_SPARSE_SOLVER_H_
#define DLCS_CORE_LCP_STRUCTURED_SPARSE_SOLVER_H_

#include <memory>

#include "core/lcp/basis/principal_pivoting.h"
#include "core/lcp/structured/sparse_point.h"
#include "core/matrix_classes/matrix_class.h"

namespace dlcs {

// Block principal pivoting with a sparse factorization of M_SS for each basis: LDLᵀ for symmetric M, LU for
// others. No n × n matrix is formed. Memory and the work of a round are those of the factors of M_SS; a guess
// that is off by little takes two or three rounds, and one that is right, with the factors kept, two
// triangular solves.
class SparseLcpSolver final : public LcpSolver {
 public:
  // What is known of M, and trusted.
  enum class Known {
    kPMatrix,
    kMMatrix,  // P and Z
  };

  SparseLcpSolver(const SparseMatrix& M, Known known);

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                   Eigen::Ref<Vector> y) override;
  LcpStats Account() const override { return account_; }
  std::unique_ptr<LcpSolver> Clone() const override;

 private:
  SparseLcpSolver(SparseLcp lcp, Exchange exchange);

  bool Pivot(int max_rounds);
  // Once more, with fifty times the rounding of each row allowed for.
  bool PivotLoosely();

  SparseLcp lcp_;
  SparsePoint point_;
  Exchange exchange_;
  Basis ordered_;  // the basis in the order of lcp_
  LcpStats account_;
};

// The solver of LCP(q, M) for a sparse M: TridiagonalSolver or SparseLcpSolver. `choice` is taken on trust,
// as by MakeLcpSolver(). Null where no sparse solver serves: for selections other than kUnique, and than
// kLeastElement of an M-matrix.
std::unique_ptr<LcpSolver> MakeSparseLcpSolver(const SparseMatrix& M, const SolutionChoice& choice);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_SPARSE_SOLVER_H_
