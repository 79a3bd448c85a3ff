// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/minimizer.h"

#include <algorithm>

#include "core/lcp/basis/tolerance.h"
#include "core/lcp/dense/basic_solutions.h"
#include "core/lcp/dense/least_norm.h"
#include "core/lcp/dense/nearest_point.h"
#include "core/matrix_classes/positive_semidefinite.h"

namespace dlcs {
namespace {

// The best of the solutions offered so far.
class Contest {
 public:
  explicit Contest(const Selector& selector) : selector_(selector) {}

  void Offer(const Vector& y, bool unique) {
    const double distance = (selector_.C * y - selector_.b).norm(), norm = y.norm();
    const double tie = kSameResult * (distance + distance_ + selector_.b.norm());
    const double near = kSameResult * (norm + y_.norm());
    if (!any() || distance < distance_ - tie) {
      Take(y, distance);
      unique_ = unique;
    } else if (distance <= distance_ + tie) {
      unique_ = unique_ && unique && (y - y_).norm() <= near;
      if (norm < y_.norm() - near) Take(y, distance);
    }
  }

  bool any() const { return y_.size() > 0; }
  bool unique() const { return unique_; }
  const Vector& y() const { return y_; }

 private:
  void Take(const Vector& y, double distance) {
    y_ = y;
    distance_ = distance;
  }

  const Selector& selector_;
  Vector y_;
  double distance_ = 0;
  bool unique_ = true;
};

}  // namespace

MinimizerSolver::MinimizerSolver(const Matrix& M, const Selector& selector) : M_(M), selector_(selector) {
  if (TestPositiveSemidefinite(M).yes()) any_.emplace(M, ComplementarySolver::Known::kNothing);
}

LcpStatus MinimizerSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                 Basis& basis, Eigen::Ref<Vector> y) {
  only_choice_ = true;
  Vector solution = Vector::Zero(q.size());
  const LcpStatus verdict =
      any_ ? MinimizeConvex(q, tolerance, basis, solution) : MinimizeByEnumeration(q, tolerance, solution);
  y = solution;
  for (Index i = 0; i < y.size(); ++i) basis[i] = y[i] > 0;
  return verdict;
}

LcpStatus MinimizerSolver::MinimizeConvex(const Vector& q, const Vector& tolerance, Basis& basis, Vector& y) {
  const LcpStatus verdict = any_->Solve(q, tolerance, basis, y);
  account_ = any_->Account();
  if (verdict != LcpStatus::kSolved || IsPlainlyUnique(M_, q, y)) return verdict;
  account_.method = "quadratic programming";
  const NearestPoint nearest = FindNearestPoint(ConvexSolutionSet(M_, q, y), selector_);
  if (nearest.answer != Feasibility::kFeasible) {
    account_.message = "there are solutions, but rounding hides which of them is the minimizer";
    y.setZero();
    return LcpStatus::kSingular;
  }
  only_choice_ = nearest.unique;
  y = nearest.v;
  return verdict;
}

LcpStatus MinimizerSolver::MinimizeByEnumeration(const Vector& q, const Vector& tolerance, Vector& y) {
  account_ = {.pivots = 0, .method = "enumeration", .message = ""};
  if (!q.allFinite()) {
    account_.message = "q has an entry that is not finite";
    return LcpStatus::kNonFinite;
  }
  const BasicSolutions all = AllBasicSolutions(M_, q, {}, tolerance);
  Contest contest(selector_);
  for (const BasicSolution& solution : all.solutions) contest.Offer(solution.y, true);
  for (const SolutionFace& face : all.faces) {
    const NearestPoint nearest =
        FindNearestPoint(SolutionFaceOf(M_, q, face.basis), {selector_.C(Eigen::all, face.basis), selector_.b});
    if (nearest.answer != Feasibility::kFeasible) continue;
    Vector point = Vector::Zero(q.size());
    point(face.basis) = nearest.v;
    contest.Offer(point, nearest.unique);
  }
  if (contest.any() && all.complete) {
    only_choice_ = contest.unique();
    y = contest.y();
    return LcpStatus::kSolved;
  }
  account_.message =
      all.complete ? "no choice of active constraints solves it"
                   : "the minimizer is not determined: a basis is nearly singular, or there are too many solutions";
  return all.complete ? LcpStatus::kInfeasible : LcpStatus::kSingular;
}

}  // namespace dlcs
