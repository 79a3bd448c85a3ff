// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/newton_step.h"

#include <limits>

#include "core/context/solve_context.h"
#include "core/lcp/basis/tolerance.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"
#include "core/linalg/pseudo_inverse.h"

namespace dlcs {
namespace {

constexpr Index kMaxIterations = 50;

// Of a sum, on each of its terms. Results that are no more than their rounding count as zero.
constexpr Index kOperationsOfSums = 32;

bool IsRegular(const PanelLu& lu) { return lu.ReciprocalCondition() > RoundingOf(2); }

}  // namespace

Matrix NewtonMatrix(const Problem& problem, const Matrix& y_after, const std::vector<Index>& active,
                    Selection selection) {
  Matrix V = Matrix::Identity(problem.num_states(), problem.num_states());
  if (active.empty()) return V;
  if (selection == Selection::kLeastNorm) {
    V += y_after(Eigen::all, active) *
         FactorOfAnyRank(problem.M.Dense()(active, active)).solve(problem.N.Dense()(active, Eigen::all)).eval();
    return V;
  }
  const PanelLu lu(problem.M.Dense()(active, active));
  if (!IsRegular(lu)) return V.setConstant(std::numeric_limits<double>::quiet_NaN());
  V += Product(Matrix(y_after(Eigen::all, active)), lu.Solve(Matrix(problem.N.Dense()(active, Eigen::all))));
  return V;
}

NewtonStep::NewtonStep(const Problem& problem, const Scheme& scheme, const SolutionChoice& choice)
    : problem_(problem),
      abs_N_(problem.N.Dense().cwiseAbs()),
      y_after_(scheme.y_after),
      selection_(choice.selection),
      solver_(MakeLcpSolver(problem.M, choice)),
      basis_(problem.num_constraints(), 0) {}

void NewtonStep::StartFrom(const Eigen::Ref<const Vector>& y) {
  for (Index i = 0; i < y.size(); ++i) basis_[static_cast<std::size_t>(i)] = y[i] > 0;
}

bool NewtonStep::Factor(const std::vector<Index>& active) {
  if (factored_ && factored_active_ == active) return regular_;
  const Matrix V = NewtonMatrix(problem_, y_after_, active, selection_);
  factored_ = true;
  factored_active_ = active;
  regular_ = V.allFinite();
  if (regular_) {
    lu_.emplace(V);
    regular_ = IsRegular(*lu_);
  }
  return regular_;
}

NewtonVerdict NewtonStep::Solve(const Eigen::Ref<const Vector>& p, const Eigen::Ref<const Vector>& g,
                                const Vector& size_of_g, Eigen::Ref<Vector> u, Eigen::Ref<Vector> y) {
  residuals_.clear();
  for (Index k = 0; k <= kMaxIterations; ++k) {
    q_ = g;
    q_.noalias() += problem_.N * u;
    tolerance_ = size_of_g;
    tolerance_.noalias() += abs_N_ * u.cwiseAbs();
    tolerance_ *= kLcpTolerance;
    if (solver_->Solve(q_, tolerance_, basis_, y) != LcpStatus::kSolved) return NewtonVerdict::kNoSolution;

    residual_ = u - p;
    residual_.noalias() -= y_after_ * y;
    residuals_.push_back(MaxAbs(residual_));
    active_.clear();
    for (Index i = 0; i < y.size(); ++i) {
      if (y[i] > 0) active_.push_back(i);
    }
    const bool least_norm = selection_ == Selection::kLeastNorm;
    const bool same_piece = k > 0 && active_ == last_active_ && !least_norm;
    const double rounding = least_norm ? kWorkingPrecision : RoundingOf(kOperationsOfSums);
    if (same_piece || (residual_.array().abs() <= rounding * (u.array().abs() + p.array().abs())).all()) {
      return NewtonVerdict::kConverged;
    }
    if (!Factor(active_)) return NewtonVerdict::kSingular;
    u -= lu_->Solve(residual_).col(0);
    last_active_ = active_;
  }
  return NewtonVerdict::kIterationLimit;
}

}  // namespace dlcs
