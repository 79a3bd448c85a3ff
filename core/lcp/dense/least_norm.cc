// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/least_norm.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/lcp/basis/solution_function.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/dense/enumeration.h"
#include "core/lcp/dense/nearest_point.h"
#include "core/linalg/equilibration.h"
#include "core/linalg/panel_lu.h"
#include "core/linalg/pseudo_inverse.h"
#include "core/matrix_classes/p_matrix.h"

namespace dlcs {
namespace {

using Known = ComplementarySolver::Known;

// Parts of ‖M‖: the first separates bases that differ by more than a thousandth, the last is safe from rounding still.
constexpr double kRegularizations[] = {1e-3, 1e-5, 1e-7, 1e-9};

}  // namespace

bool IsPlainlyUnique(const Matrix& M, const Vector& q, const Vector& y) {
  IndexSets sets = FindIndexSets(M, q, y);
  const std::vector<Index> K = std::exchange(sets.K, {});
  if (!TestDifferentiable(M, sets).yes()) return false;
  if (K.empty()) return true;
  const Index size = static_cast<Index>(sets.J.size());
  std::vector<Index> order = sets.J;
  order.insert(order.end(), K.begin(), K.end());
  const Matrix scaled = Scaled(M(order, order), EquilibrateRowsAndColumns(M(order, order)));
  Matrix rest = scaled.bottomRightCorner(order.size() - size, order.size() - size);
  if (size > 0) {
    rest -= scaled.bottomLeftCorner(rest.rows(), size) *
            PanelLu(scaled.topLeftCorner(size, size)).Solve(scaled.topRightCorner(size, rest.cols()));
  }
  return (rest.diagonal().array() > kWorkingPrecision).all() && TestPMatrix(rest).yes();
}

LeastNormSolver::LeastNormSolver(const Matrix& M) : M_(M), any_(M, Known::kNothing) {
  const double norm = M.cwiseAbs().maxCoeff();
  for (const double part : kRegularizations) {
    const double epsilon = norm > 0 ? part * norm : part;
    regularized_.emplace_back(M + epsilon * Matrix::Identity(M.rows(), M.cols()), Known::kPMatrix);
  }
}

LcpStatus LeastNormSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                 Basis& basis, Eigen::Ref<Vector> y) {
  const LcpStatus verdict = any_.Solve(q, tolerance, basis, y);
  account_ = any_.Account();
  if (verdict != LcpStatus::kSolved || IsPlainlyUnique(M_, q, y)) return verdict;

  account_.method = "regularization (least norm)";
  const Vector any_solution = y;
  for (ComplementarySolver& solver : regularized_) {
    if (solver.Solve(q, tolerance, basis, y) != LcpStatus::kSolved) continue;
    account_.pivots += solver.Account().pivots;
    if (IsLimit(q, tolerance, IndicesOf(basis), y)) return verdict;
  }
  account_.method = "quadratic programming (least norm)";
  const Index n = M_.rows();
  const NearestPoint nearest =
      FindNearestPoint(ConvexSolutionSet(M_, q, any_solution), {Matrix::Identity(n, n), Vector::Zero(n)});
  if (nearest.answer != Feasibility::kFeasible) {
    account_.message = "there are solutions, but rounding hides which of them is least in norm";
    y.setZero();
    return LcpStatus::kSingular;
  }
  y = nearest.v;
  for (Index i = 0; i < n; ++i) basis[i] = y[i] > 0;
  return verdict;
}

// Computes y* of the basis S into `y`; whether it solves LCP(q, M) and is proven least.
bool LeastNormSolver::IsLimit(const Vector& q, const Vector& tolerance, const std::vector<Index>& S,
                              Eigen::Ref<Vector> y) const {
  const Index n = q.size();
  const Matrix M_S = M_(Eigen::all, S);
  Vector y_S, slope_S;  // -M_SS⁺ q_S, -M_SS⁺ y_S
  if (!S.empty()) {
    const auto block = FactorOfAnyRank(M_(S, S));
    y_S = -block.solve(q(S));
    slope_S = -block.solve(y_S);
  }
  const Vector w = q + M_S * y_S;
  const Vector zero = kWorkingPrecision * (q.cwiseAbs() + M_S.cwiseAbs() * y_S.cwiseAbs()) + tolerance;
  const double zero_y = y_S.size() > 0 ? kWorkingPrecision * y_S.lpNorm<Eigen::Infinity>() : 0;

  Vector slope = Vector::Zero(n);  // y'
  slope(S) = slope_S;
  const Vector slope_w = M_ * slope;  // w' outside of S, where y* = 0
  const Vector zero_slope_w = kSameResult * (M_.cwiseAbs() * slope.cwiseAbs());
  const double zero_slope = kSameResult * slope.lpNorm<Eigen::Infinity>();

  y.setZero();
  std::size_t p = 0;
  for (Index i = 0; i < n; ++i) {
    if (p < S.size() && S[p] == i) {
      const double value = y_S[static_cast<Index>(p++)];
      if (std::abs(w[i]) > zero[i] || value < -zero_y) return false;
      if (value <= zero_y && slope[i] < -zero_slope) return false;
      y[i] = value > zero_y ? value : 0;
    } else if (w[i] < -zero[i] || (w[i] <= zero[i] && slope_w[i] < -zero_slope_w[i])) {
      return false;
    }
  }
  return true;
}

}  // namespace dlcs
