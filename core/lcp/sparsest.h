// SPDX-License-Identifier: Apache-2.0
// The solution of LCP(q, M) with the fewest positive components.

#ifndef DLCS_CORE_LCP_SPARSEST_H_
#define DLCS_CORE_LCP_SPARSEST_H_

#include <memory>

#include "core/lcp/basis/lcp_solver.h"
#include "core/types.h"

namespace dlcs {

// "The sparse solution" of Remark 3.1 in [Wu & Chen]: of all solutions one with the fewest y_i > 0; of several the one
// of least norm, of these the first in the order of bases, and IsOnlyChoice() is false. As a function of q it may jump.
//
// Supports S are looked at by their size, n <= kMaxSolutionEnumeration: the point of a nonsingular M_SS, the point of
// least norm of the face of a singular one (core/lcp/dense/nearest_point.h). The first size with a solution ends it; so
// at most 2ⁿ factorizations. For a Z-matrix the least element is the sparsest solution, which needs none of this: it is
// below all others, and so positive in no more components.
class SparsestSolver final : public LcpSolver {
 public:
  explicit SparsestSolver(const Matrix& M) : M_(M) {}

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  bool IsOnlyChoice() const override { return only_choice_; }
  LcpStats Account() const override { return account_; }
  std::unique_ptr<LcpSolver> Clone() const override { return std::make_unique<SparsestSolver>(M_); }

 private:
  Matrix M_;
  LcpStats account_;
  bool only_choice_ = true;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_SPARSEST_H_
