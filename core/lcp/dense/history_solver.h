// SPDX-License-Identifier: Apache-2.0
// The solution that continues the one before.

#ifndef DLCS_CORE_LCP_DENSE_HISTORY_SOLVER_H_
#define DLCS_CORE_LCP_DENSE_HISTORY_SOLVER_H_

#include <memory>
#include <string>
#include <vector>

#include "core/lcp/basis/basis_point.h"
#include "core/lcp/dense/lemke.h"

namespace dlcs {

// For any M, where LCP(q, M) may have several solutions. The guess is the basis of the solution before. It is kept
// where it still is a solution. Otherwise the path is followed on which what it violates, y_S or w off S, is raised by
// z >= 0, from the z at which the guess is a solution to z = 0 (Lemke's method in the basis of the guess). Where the
// solution before ends in a fold, the path turns there, runs back along the solutions between, and turns again into the
// branch beyond: so a comparator with hysteresis goes from one output to the other, and never rests in the middle.
//
// Pairs that depend on each other, a strongly connected component of the graph of M, are a block. First each block
// follows its own path, given those before it: of two comparators that turn at the same time none waits for the other.
// What K couples is that of the solution before; in blocks with a positive semidefinite M, which have no folds, that of
// the new one.
//
// Where the path does not end in a solution, or ends between two folds, small problems are searched for all: if there
// is one alone it is taken. Otherwise all of y_S and w off S are raised a little, or as much as what is violated: a
// path inside of the cone of the guess does not meet the ties on its boundary. In a block without folds any solution
// will do, by core/lcp/dense/complementary_solver.h. kRay where none of them ends in a solution.
class HistorySolver final : public LcpSolver {
 public:
  explicit HistorySolver(const Matrix& M);
  // Of LCP(q, M + K), where K is small beside M: the blocks are those of M.
  HistorySolver(const Matrix& M, const Matrix& K);

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  LcpStats Account() const override { return {pivots_, "path from the solution before", message_}; }
  std::unique_ptr<LcpSolver> Clone() const override { return std::make_unique<HistorySolver>(*this); }

 private:
  void DropIdle(Basis& basis);
  bool SolveBlocks(Basis& basis);
  bool IsBetween(const Basis& basis) const;
  bool LeavesWithoutNeed(const Basis& basis);
  Vector ScaledY() const;
  bool IsOnlyOne(Basis& basis);
  bool FindAny(Basis& basis);

  ScaledLcp lcp_;
  BasisPoint point_;
  Lemke lemke_;
  std::vector<std::vector<Index>> blocks_;  // empty if there is one
  Matrix of_solved_;                        // M, scaled, by which blocks depend on those before them
  Matrix of_start_;                         // K, scaled, where the solution before stands for the new one
  std::vector<HistorySolver> of_blocks_;
  bool may_fold_ = true;  // M is not known to be positive semidefinite
  Basis start_;
  Index pivots_ = 0;
  std::string message_;
};

// The sign of the determinant of M in `basis`, which all solutions on one path have; 0 if it is singular.
int SignOfDeterminant(const Matrix& M, const Basis& basis);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_HISTORY_SOLVER_H_
