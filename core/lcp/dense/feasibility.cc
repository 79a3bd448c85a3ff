// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/feasibility.h"

#include <algorithm>

#include "core/lcp/basis/basis_point.h"
#include "core/lcp/dense/lemke.h"

namespace dlcs {
namespace {

// Farkas' lemma for c + C y >= 0.
bool IsFarkas(const Eigen::Ref<const Matrix>& C, const Eigen::Ref<const Vector>& c,
              const Eigen::Ref<const Vector>& tolerance, const Eigen::Ref<const Vector>& multiplier, double rounding) {
  const Vector lambda = multiplier.cwiseMax(0);
  const Vector product = C.transpose() * lambda;
  const Vector product_size = C.cwiseAbs().transpose() * lambda;
  if ((product.array() > rounding * product_size.array()).any()) return false;
  return lambda.dot(c) < -(lambda.dot(tolerance) + kWorkingPrecision * lambda.dot(c.cwiseAbs()));
}

}  // namespace

FeasiblePoint FindFeasiblePoint(const Matrix& C, const Vector& c, const Vector& tolerance, double rounding) {
  const Index rows = C.rows();
  const Index columns = C.cols();
  // Optimality of min 0ᵀy: 0 <= y ⟂ -Cᵀλ >= 0, 0 <= λ ⟂ c + C y >= 0.
  Matrix skew = Matrix::Zero(columns + rows, columns + rows);
  skew.topRightCorner(columns, rows) = -C.transpose();
  skew.bottomLeftCorner(rows, columns) = C;
  Vector q = Vector::Zero(columns + rows);
  q.tail(rows) = c;
  Vector tolerances = Vector::Zero(q.size());
  tolerances.tail(rows) = tolerance;
  ScaledLcp lcp(skew);
  if (!lcp.Load(q, tolerances)) return {};
  BasisPoint point(lcp, Elimination::kPivoting);
  Lemke lemke(columns + rows);
  Basis basis(columns + rows, 0);
  FeasiblePoint found;
  FollowWithRetries([&](double zero) {
    const LemkeEnd end = lemke.Run(lcp, zero, basis);
    if (end == LemkeEnd::kRay) {
      Vector multiplier(rows);
      for (Index i = 0; i < rows; ++i) multiplier[i] = lcp.Original(columns + i, lemke.ray()[columns + i]);
      if (IsFarkas(C, c, tolerance, multiplier, rounding)) found.answer = Feasibility::kInfeasible;
    } else if (end == LemkeEnd::kBasis && point.Compute(lcp, basis) && point.solved()) {
      Vector solution(columns + rows);
      point.Write(lcp, solution);
      found = {Feasibility::kFeasible, solution.head(columns)};
    }
    return found.answer != Feasibility::kUnknown;
  });
  return found;
}

bool ProvesInfeasible(const ScaledLcp& lcp, const Eigen::Ref<const Vector>& ray) {
  const Vector multiplier = ray.cwiseProduct(lcp.matrix->scale.column).cwiseQuotient(lcp.matrix->scale.row);
  return IsFarkas(lcp.M(), lcp.q, lcp.tolerance, multiplier, kWorkingPrecision) ||
         IsFarkas(lcp.M(), lcp.q, lcp.tolerance, ray, kWorkingPrecision);
}

}  // namespace dlcs
