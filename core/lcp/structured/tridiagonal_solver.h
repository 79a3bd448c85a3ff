// SPDX-License-Identifier: Apache-2.0
// LCPs with a tridiagonal M-matrix, as a solver like the others.

#ifndef DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_SOLVER_H_
#define DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_SOLVER_H_

#include <functional>
#include <memory>
#include <optional>

#include "core/lcp/basis/lcp_solver.h"
#include "core/lcp/structured/policy_iteration.h"
#include "core/matrix_classes/matrix_class.h"

namespace dlcs {

// The diagonals of `M` where TridiagonalSolver and PolicyLanes serve: a tridiagonal matrix, clearly an
// M-matrix, whose solution (it is the least element as well) is asked for.
std::optional<Tridiagonal> DiagonalsForPolicyIteration(const Matrix& M, const SolutionChoice& choice);

// Policy iteration from the guess; where that does not settle, from the basis of GrowLeastBasis(); and where
// numbers overflow, `general`, which gives the verdict then. O(n) in all, and no n × n matrix is formed.
class TridiagonalSolver final : public LcpSolver {
 public:
  // `M` must be what IsClearlyMMatrix() asks for. `make_general` makes a solver for the same matrix, when it is needed;
  // it may be null: what policy iteration leaves is then kNonFinite or kSingular (numbers overflowed).
  using MakeGeneral = std::function<std::unique_ptr<LcpSolver>()>;
  TridiagonalSolver(std::shared_ptr<const Tridiagonal> M, MakeGeneral make_general);

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                   Eigen::Ref<Vector> y) override;
  LcpStats Account() const override;
  std::unique_ptr<LcpSolver> Clone() const override;

 private:
  // From the basis of GrowLeastBasis(). Where y_i and w_i vanish together in an ill-conditioned problem, the
  // rounding of y may be more than that of the sum w_i, and an index goes in and out: then what may be
  // there by rounding alone leaves the basis, and after that w_i is allowed fifty times its rounding.
  bool SolveFromNothing(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                        Eigen::Ref<Vector> y);

  std::shared_ptr<const Tridiagonal> M_;
  PolicyIteration iteration_;
  MakeGeneral make_general_;
  std::unique_ptr<LcpSolver> general_;
  LcpStats account_;  // of the last solve, where `general_` was not asked
  bool by_general_ = false;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_SOLVER_H_
