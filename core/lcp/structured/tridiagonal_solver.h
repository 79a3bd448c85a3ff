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

// Chandrasekaran's method (core/lcp/dense/least_element.h): the basis S grows from the empty one by indices with
// w_j < 0, each of which belongs to the basis of the least element. S falls into runs of neighbors, and w_j
// needs no more of a run than y at the end that touches j. Of each run we keep y and the inverse of its block
// at its two ends; a new index joins the runs on its left and right in a dozen operations, and only the two
// indices beside the new run have to be looked at again. Every index enters once: O(n) in all, where policy
// iteration from a bad guess may take O(n) rounds. All sums are of numbers of one sign, so nothing cancels.
//
// `M` must be what IsClearlyMMatrix() asks for; `basis` (n entries) is overwritten, and right up to rounding;
// adds |S| to `pivots`. w_j counts as negative below `tolerance`_j and rounding, as in PolicyIteration.
//
// Source: the same bound is reached by another method in [Cryer 1983] C. W. Cryer. The efficient solution of linear
// complementarity problems for tridiagonal Minkowski matrices. ACM Trans. Math. Software 9(2), 199-214.
void GrowLeastBasis(const Tridiagonal& M, const Eigen::Ref<const Vector>& q,
                    const Eigen::Ref<const Vector>& tolerance, Basis& basis, Index& pivots);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_TRIDIAGONAL_SOLVER_H_
