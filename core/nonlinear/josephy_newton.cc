// SPDX-License-Identifier: Apache-2.0

#include "core/nonlinear/josephy_newton.h"

#include <cmath>
#include <utility>

#include "core/lcp/basis/tolerance.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_lu.h"
#include "core/linalg/panel_product.h"
#include "core/matrix_classes/m_matrix.h"

namespace dlcs {
namespace {

using Verdict = ComplementarityResult::Verdict;

constexpr Index kMaxSteps = 50;
// A kept Jacobian is used as long as it lowers the merit by this factor; a fresh one must lower it by kDescent of the
// step length.
constexpr double kServes = 1e-2;
constexpr double kDescent = 1e-4;
constexpr int kHalvings = 20;

// y + w - sqrt(y² + w²), zero exactly where 0 <= y ⟂ w >= 0.
Vector FischerBurmeister(const Vector& y, const Vector& w) {
  return y.binaryExpr(w, [](double a, double b) { return a + b - std::hypot(a, b); });
}

}  // namespace

struct JosephyNewton::Point {
  Point(const ComplementarityFunction& function, Vector at) : y(std::move(at)), value(function.value(y)) {
    merit = FischerBurmeister(y, value).squaredNorm() / 2;
  }
  bool finite() const { return std::isfinite(merit); }
  Vector y, value;
  double merit;
};

bool JosephyNewton::Linearize(const ComplementarityFunction& function, const Vector& y) {
  solver_.reset();
  jacobian_ = function.jacobian(y);
  if (!jacobian_.allFinite()) return false;
  // The class was determined before; that of a Z-matrix is checked again, since without it there is no least element.
  const bool lost = selection_ == Selection::kLeastElement && !IsZMatrix(jacobian_);
  solver_ = MakeLcpSolver(jacobian_, lost ? Selection::kAny : selection_);
  return true;
}

LcpStatus JosephyNewton::SolveLinearized(const Point& point, Vector& y) {
  const Vector q = point.value - jacobian_ * point.y;
  const Vector size = point.value.cwiseAbs() + jacobian_.cwiseAbs() * point.y.cwiseAbs();
  Basis basis(point.y.size());
  for (Index i = 0; i < point.y.size(); ++i) basis[i] = point.y[i] > 0;
  y.resize(point.y.size());
  LcpStatus verdict = solver_->Solve(q, kLcpTolerance * size, basis, y);
  if (verdict == LcpStatus::kSolved || selection_ != Selection::kUnique) return verdict;
  // The Jacobian here need not be a P-matrix because one elsewhere was.
  solver_ = MakeLcpSolver(jacobian_, Selection::kAny);
  return solver_->Solve(q, kLcpTolerance * size, basis, y);
}

bool JosephyNewton::SmallResidual(const Point& point, double tolerance) const {
  const Vector residual = point.y.cwiseMin(point.value).cwiseAbs();
  const Vector size = point.value.cwiseAbs() + jacobian_.cwiseAbs() * point.y.cwiseAbs();
  return point.finite() && (residual.array() <= tolerance * size.array()).all();
}

bool JosephyNewton::LevenbergMarquardt(const ComplementarityFunction& function, Point& point) const {
  const Vector phi = FischerBurmeister(point.y, point.value);
  Matrix slope = jacobian_;  // an element of the generalized Jacobian of Φ
  for (Index i = 0; i < phi.size(); ++i) {
    const double a = point.y[i], b = point.value[i], r = std::hypot(a, b);
    slope.row(i) *= r > 0 ? 1 - b / r : 1 - std::sqrt(0.5);
    slope(i, i) += r > 0 ? 1 - a / r : 1 - std::sqrt(0.5);
  }
  const Vector gradient = slope.transpose() * phi;
  Matrix normal = Product(slope.transpose(), slope);
  normal.diagonal().array() += 1e-10 * MaxAbs(normal.diagonal()) + 1e-3 * std::min(1.0, point.merit);
  const Vector direction = -PanelLu(std::move(normal)).Solve(gradient);
  if (!direction.allFinite()) return false;
  double length = 1;
  for (int halving = 0; halving <= kHalvings; ++halving, length /= 2) {
    Point trial(function, point.y + length * direction);
    if (trial.merit > point.merit + kDescent * length * gradient.dot(direction) || !trial.finite()) continue;
    point = std::move(trial);
    return true;
  }
  return false;
}

ComplementarityResult JosephyNewton::Solve(const ComplementarityFunction& function, Vector& y) {
  ComplementarityResult result;
  Point point(function, y);
  const auto finish = [&](Verdict verdict, std::string why) {
    y = point.y.cwiseMax(0);
    result.verdict = verdict;
    result.residual = NaturalResidual(point.y, point.value);
    result.why = std::move(why);
    return result;
  };
  if (!point.finite()) return finish(Verdict::kNonFinite, "the function is not finite");
  bool fresh = !solver_;
  if (fresh && !Linearize(function, point.y)) return finish(Verdict::kNonFinite, "the Jacobian is not finite");
  LcpStatus lcp = LcpStatus::kSolved;
  for (; result.lcps < kMaxSteps;) {
    Vector target;
    lcp = SolveLinearized(point, target);
    ++result.lcps;
    bool moved = false;
    if (lcp == LcpStatus::kSolved) {
      double length = 1;
      for (int halving = 0; !moved && halving <= (fresh ? kHalvings : 0); ++halving, length /= 2) {
        Point trial(function, point.y + length * (target - point.y));
        const double allowed = fresh ? 1 - kDescent * length : kServes;
        const bool solved = length == 1 && SmallResidual(trial, kLcpTolerance);
        if (!solved && !(trial.finite() && trial.merit <= allowed * point.merit)) continue;
        moved = true;
        point = std::move(trial);
        if (solved) return finish(Verdict::kSolved, {});
      }
    }
    if (moved) {
      fresh = false;
      continue;
    }
    if (!fresh) {  // the kept Jacobian no longer serves
      if (!Linearize(function, point.y)) return finish(Verdict::kNonFinite, "the Jacobian is not finite");
      fresh = true;
      continue;
    }
    if (lcp == LcpStatus::kSolved && SmallResidual(point, kSameResult)) return finish(Verdict::kSolved, {});
    if (!LevenbergMarquardt(function, point)) break;
    if (!Linearize(function, point.y)) return finish(Verdict::kNonFinite, "the Jacobian is not finite");
  }
  if (lcp == LcpStatus::kInfeasible) {
    return finish(Verdict::kInfeasible, "the LCP of the linearized g has no solution");
  }
  return finish(Verdict::kStalled, "Newton's method makes no progress after " + std::to_string(result.lcps) +
                                       " LCPs (the last ended as " + LcpStatusName(lcp) + ")");
}

}  // namespace dlcs
