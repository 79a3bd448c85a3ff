// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/sparsest.h"

#include <bit>
#include <cmath>
#include <vector>

#include "core/lcp/basis/basis_point.h"
#include "core/lcp/basis/polish.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/dense/enumeration.h"
#include "core/lcp/dense/nearest_point.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// The best of the solutions with as many positive components as the first.
class Contest {
 public:
  void Offer(const Vector& y) {
    if (any()) {
      const double near = kSameResult * (y.norm() + y_.norm());
      if ((y - y_).norm() <= near) return;
      only_one_ = false;
      if (!(y.norm() < y_.norm() - near)) return;
    }
    y_ = y;
  }

  bool any() const { return y_.size() > 0; }
  bool only_one() const { return only_one_; }
  const Vector& y() const { return y_; }

 private:
  Vector y_;
  bool only_one_ = true;
};

}  // namespace

LcpStatus SparsestSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                Basis& basis, Eigen::Ref<Vector> y) {
  account_ = {.pivots = 0, .method = "enumeration (fewest positive components)", .message = ""};
  only_choice_ = true;
  y.setZero();
  ScaledLcp lcp(M_);
  if (!lcp.Load(q, tolerance)) {
    account_.message = "q has an entry that is not finite";
    return LcpStatus::kNonFinite;
  }
  const Index n = q.size();
  const double q_size = MaxAbs(lcp.q);
  const int exponent = q_size > 0 ? std::ilogb(q_size) : 0;
  const Vector q_of_size_one = std::ldexp(1.0, -exponent) * lcp.q;
  BasisPoint point(lcp, Elimination::kPivoting);
  Contest contest;
  const bool exactly = (tolerance.array() == 0).all();
  bool decided = true;
  Vector solution(n);
  for (int count = 0; count <= n && !contest.any(); ++count) {
    for (unsigned subset = 0; subset < 1u << n; ++subset) {
      if (std::popcount(subset) != count) continue;
      LookForStop();
      const Basis S = BasisOf(subset, n);
      if (point.Compute(lcp, S) && point.accurate()) {
        if (point.solved()) {
          point.Write(lcp, solution);
          if (exactly) PolishSolution(M_, q, solution);
          contest.Offer(solution);
        } else if (point.IsDoubtful(lcp, S)) {
          decided = decided && exactly && SolveFaceExactly(M_, q, IndicesOf(S)).answer == Feasibility::kInfeasible;
        }
        continue;
      }
      const std::vector<Index> indices = IndicesOf(S);
      // In units in which M, q and y are of size one.
      const Vector column = lcp.matrix->scale.column(indices) * std::ldexp(1.0, exponent);
      const Vector unit = column / (column.size() > 0 ? column.maxCoeff() : 1.0);
      const NearestPoint nearest =
          FindNearestPoint(SolutionFaceOf(lcp.M(), q_of_size_one, indices), {unit.asDiagonal(), Vector::Zero(count)});
      FeasiblePoint face{nearest.answer, nearest.v};
      if (face.answer == Feasibility::kFeasible) face.y = column.cwiseProduct(nearest.v);
      if (face.answer == Feasibility::kUnknown && exactly) face = SolveFaceExactly(M_, q, indices);
      if (face.answer == Feasibility::kUnknown) decided = false;
      if (face.answer != Feasibility::kFeasible) continue;
      solution.setZero();
      solution(indices) = face.y;
      contest.Offer(solution);
    }
  }
  if (contest.any() && decided) {
    only_choice_ = contest.only_one();
    y = contest.y();
    for (Index i = 0; i < n; ++i) basis[i] = y[i] > 0;
    return LcpStatus::kSolved;
  }
  account_.message = decided ? "no choice of active constraints solves it"
                             : "a nearly singular basis leaves open which solution has the fewest positive components";
  return decided ? LcpStatus::kInfeasible : LcpStatus::kSingular;
}

}  // namespace dlcs
