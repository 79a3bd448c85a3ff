// SPDX-License-Identifier: Apache-2.0
// LCPs with a large sparse matrix.

#ifndef DLCS_CORE_LCP_STRUCTURED_SPARSE_SOLVER_H_
#define DLCS_CORE_LCP_STRUCTURED_SPARSE_SOLVER_H_

#include <memory>
#include <vector>

#include "core/lcp/basis/principal_pivoting.h"
#include "core/lcp/structured/sparse_basis_factor.h"
#include "core/matrix_classes/matrix_class.h"

namespace dlcs {

// LCP(q, M) with its indices in an order in which factors of M fill in little (approximate minimum degree).
struct SparseLcp {
  explicit SparseLcp(const SparseMatrix& original);

  // Takes the right-hand side and the tolerances of w, in the caller's order. False when an entry of `q` is
  // not finite.
  bool Load(const Eigen::Ref<const Vector>& original_q, const Eigen::Ref<const Vector>& original_tolerance);

  Index size() const { return q.size(); }

  struct Ordered {
    SparseMatrix M;
    std::vector<Index> original;  // index i here is original[i] of the caller
    bool symmetric = false;
  };
  std::shared_ptr<const Ordered> matrix;  // shared by copies
  Vector q;
  Vector tolerance;
};

// For a basis S: y_S = -M_SS⁻¹ q_S, y = 0 elsewhere, w = q + M y; as BasisPoint, without scaling:
//     allowed_i = tolerance_i + 1e-14 (|q_i| + Σ_j |M_ij y_j|)
// knows the units of each row, and with one step of iterative refinement that is what a factorization reaches
// [Skeel 1980].
class SparsePoint {
 public:
  explicit SparsePoint(Index n) : factor_(n) {}

  // False when the basis has no point: M_SS is singular, or numbers overflow. `lcp` has the same matrix in
  // all calls.
  bool Compute(const SparseLcp& lcp, const Basis& basis);

  // Indices, increasing, with a negative y_i (in S; unless setting it to zero moves no w by more than
  // allowed) or a negative w_i (not in S).
  const std::vector<Index>& violations() const { return violations_; }
  // Whether w_S is zero to the same accuracy.
  bool accurate() const { return accurate_; }
  // What every w_i may miss, the caller's tolerance included.
  const Vector& allowed() const { return allowed_; }

  // Writes y >= 0 in the caller's order.
  void Write(const SparseLcp& lcp, Eigen::Ref<Vector> y) const;

 private:
  bool Evaluate(const SparseLcp& lcp);
  bool Negligible(const SparseLcp& lcp, Index j, double value) const;

  SparseBasisFactor factor_;
  Vector y_;  // of S
  Vector w_, allowed_;
  std::vector<Index> violations_;
  bool accurate_ = false;
};

// Block principal pivoting with a sparse factorization of M_SS for each basis: LDLᵀ for symmetric M, LU for others. No
// n × n matrix is formed. Memory and the work of a round are those of the factors of M_SS; a guess that is wrong in a
// few indices takes two or three rounds, and a correct one whose factors are kept two triangular solves.
class SparseLcpSolver final : public LcpSolver {
 public:
  // What the caller knows about M; it is not checked.
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
  // Tries again with fifty times the rounding of each row as tolerance.
  bool PivotLoosely();

  SparseLcp lcp_;
  SparsePoint point_;
  Exchange exchange_;
  Basis ordered_;  // the basis in the order of lcp_
  LcpStats account_;
};

// The solver of LCP(q, M) for a sparse M: TridiagonalSolver or SparseLcpSolver. `choice` is not checked, as in
// MakeLcpSolver(). Null for selections that no sparse solver supports: all but kUnique, and kLeastElement of an
// M-matrix.
std::unique_ptr<LcpSolver> MakeSparseLcpSolver(const SparseMatrix& M, const SolutionChoice& choice);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_SPARSE_SOLVER_H_
