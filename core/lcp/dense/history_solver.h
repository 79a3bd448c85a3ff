// SPDX-License-Identifier: Apache-2.0
// The solution that continues the one before.

#ifndef DLCS_CORE_LCP_DENSE_HISTORY_SOLVER_H_
#define DLCS_CORE_LCP_DENSE_HISTORY_SOLVER_H_

#include <memory>
#include <string>

#include "core/lcp/basis/basis_point.h"
#include "core/lcp/dense/lemke.h"

namespace dlcs {

// For any M, where LCP(q, M) may have several solutions. The guess is the basis of the solution before. It is kept
// where it still is a solution. Otherwise the path is followed on which what it violates, y_S or w off S, is raised by
// z >= 0, from the z at which the guess is a solution to z = 0 (Lemke's method in the basis of the guess). Where the
// solution before ends in a fold, the path turns there, runs back along the solutions between, and turns again into the
// branch beyond: so a comparator with hysteresis goes from one output to the other, and never rests in the middle.
//
// Where the path does not end in a solution, small problems are searched for all: if there is one alone it is taken.
// Otherwise all of y_S and w off S are raised a little, or as much as what is violated: a path inside of the cone of
// the guess does not meet the ties on its boundary. kRay where none of them ends in a solution.
class HistorySolver final : public LcpSolver {
 public:
  explicit HistorySolver(const Matrix& M);

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  LcpStats Account() const override { return {pivots_, "path from the solution before", message_}; }
  std::unique_ptr<LcpSolver> Clone() const override { return std::make_unique<HistorySolver>(*this); }

 private:
  bool IsOnlyOne(Basis& basis);

  ScaledLcp lcp_;
  BasisPoint point_;
  Lemke lemke_;
  Basis start_;
  Index pivots_ = 0;
  std::string message_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_HISTORY_SOLVER_H_
