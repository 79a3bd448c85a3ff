// SPDX-License-Identifier: Apache-2.0
// LCPs with a tridiagonal M-matrix, as a solver like the others.

#ifndef DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_SOLVER_H_
#define DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_SOLVER_H_

#include <functional>
#include <memory>
#include <optional>

#include "core/lcp/basis/lcp_solver.h"
#include "core/lcp/structured/policy_iteration.h"
#include "core/lcp/structured/tridiagonal.h"
#include "core/matrix_classes/matrix_class.h"

namespace dlcs {

// The diagonals of `M`, if TridiagonalSolver and PolicyLanes can be used: M is tridiagonal and clearly an M-matrix, and
// `choice` is its unique solution or the least element, which is the same.
std::optional<Tridiagonal> DiagonalsForPolicyIteration(const Matrix& M, const SolutionChoice& choice);

// Policy iteration from the guess; if that does not converge, from the basis of GrowLeastBasis(); and if numbers
// overflow, a general solver. O(n) in all, and no n × n matrix is formed.
class TridiagonalSolver final : public LcpSolver {
 public:
  // `M` must satisfy IsClearlyMMatrix(). `make_general` makes a general solver for the same matrix when it is needed.
  // It may be null: LCPs that policy iteration cannot solve are then kNonFinite or kSingular (numbers overflowed).
  using MakeGeneral = std::function<std::unique_ptr<LcpSolver>()>;
  TridiagonalSolver(std::shared_ptr<const Tridiagonal> M, MakeGeneral make_general);

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  LcpStats Account() const override;
  std::unique_ptr<LcpSolver> Clone() const override;

 private:
  // From the basis of GrowLeastBasis(). Where y_i and w_i vanish together in an ill-conditioned problem, the rounding
  // of y may exceed that of the sum w_i, and an index may enter and leave the basis repeatedly. Then indices that may
  // be in the basis by rounding alone are removed, and after that the tolerance of w_i is fifty times its rounding.
  bool SolveFromNothing(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                        Eigen::Ref<Vector> y);

  std::shared_ptr<const Tridiagonal> M_;
  PolicyIteration iteration_;
  MakeGeneral make_general_;
  std::unique_ptr<LcpSolver> general_;
  LcpStats account_;  // of the last solve, unless it was by `general_`
  bool by_general_ = false;
};

// Chandrasekaran's method (core/lcp/dense/least_element.h): the basis S grows from the empty one by indices with w_j <
// 0, each of which belongs to the basis of the least element. S consists of runs of neighbors, and w_j depends only on
// y at the end of a run next to j. Of each run we keep y and the inverse of its block at its two ends; a new index
// joins the runs on its left and right in a dozen operations, and only the two indices next to the new run have to be
// tested again. Every index enters once: O(n) in all, where policy iteration from a bad guess may take O(n) rounds. All
// sums are of numbers of one sign, so nothing cancels.
//
// `M` must satisfy IsClearlyMMatrix(). `basis` (n entries) is overwritten, and correct up to rounding. Adds |S| to
// `pivots`. w_j counts as negative below `tolerance`_j and rounding, as in PolicyIteration.
//
// Source: the same bound is reached by another method in [Cryer 1983] C. W. Cryer. The efficient solution of linear
// complementarity problems for tridiagonal Minkowski matrices. ACM Trans. Math. Software 9(2), 199-214.
void GrowLeastBasis(const Tridiagonal& M, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                    Basis& basis, Index& pivots);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_SOLVER_H_
