// SPDX-License-Identifier: Apache-2.0
// The point that belongs to a basis of an LCP with a sparse matrix, and whether it solves it.

#ifndef DLCS_CORE_LCP_STRUCTURED_SPARSE_POINT_H_
#define DLCS_CORE_LCP_STRUCTURED_SPARSE_POINT_H_

#include <memory>
#include <vector>

#include "core/lcp/structured/sparse_basis_factor.h"

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

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_SPARSE_POINT_H_
