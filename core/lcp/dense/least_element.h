// SPDX-License-Identifier: Apache-2.0
// The least element of the feasible set of LCP(q, M) for Z-matrices.

#ifndef DLCS_CORE_LCP_DENSE_LEAST_ELEMENT_H_
#define DLCS_CORE_LCP_DENSE_LEAST_ELEMENT_H_

#include <memory>
#include <string>
#include <vector>

#include "core/lcp/basis/basis_point.h"
#include "core/matrix_classes/m_matrix.h"

namespace dlcs {

// Chandrasekaran's method. The basis S starts empty and only grows: every index r with w_r < 0 at the point
// of S is in the basis of the least element, if there is one, and so they may all be added at once. If the
// Schur complement M_rr - M_rS M_SS⁻¹ M_Sr of such an index is not positive, no y >= 0 has q + M y >= 0, and
// v = (-M_SS⁻ᵀ M_rSᵀ, 1) on (S, r) shows it: v >= 0, Mᵀv <= 0, qᵀv < 0. At most n pivots; M need not be a
// P-matrix.
//
// Warm start, for any guess S: if M_SS is a nonsingular M-matrix, every feasible y has y_S >= -M_SS⁻¹ q_S (M_SS⁻¹ >= 0
// and M_{S,rest} <= 0), so the indices where that bound is positive are in the basis of the least element, and the
// method continues from them. If it is positive for all of S and w >= 0, the point is the least element. A guess for
// which M_SS is not an M-matrix is dropped.
//
// Source: [Chandrasekaran 1970] R. Chandrasekaran. A special case of the complementary pivot problem.
//         Opsearch 7, 263-268; [Cottle, Pang & Stone 1992], Section 4.7 and Theorem 3.11.6 (least elements).
class LeastElementSolver final : public LcpSolver {
 public:
  explicit LeastElementSolver(const Matrix& M);  // a Z-matrix

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  LcpStats Account() const override;
  std::unique_ptr<LcpSolver> Clone() const override;

 private:
  // The verdict on indices whose addition makes M_SS lose the M-matrix property.
  enum class Refusal { kInfeasible, kWithinRounding, kUnclear };

  bool KeepProvenIndices(Basis& basis);
  Refusal Examine(Basis& basis);

  ScaledLcp lcp_;
  BasisPoint point_;
  MMatrixFactor ordered_;  // factors in the order of addition, for Examine()
  std::vector<Index> order_;
  std::vector<Index> added_;
  Basis excluded_;  // w_r < 0 only within the rounding of a nearly singular basis
  Vector multiplier_;
  Index pivots_ = 0;
  LcpStatus verdict_ = LcpStatus::kSolved;
  Index refused_ = -1;  // the index that proves infeasibility
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_LEAST_ELEMENT_H_
