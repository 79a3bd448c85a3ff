// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/tridiagonal_solver.h"

#include <cmath>
#include <utility>

#include "core/lcp/tridiagonal_growth.h"
#include "core/linalg/norms.h"

namespace dlcs {

std::optional<Tridiagonal> DiagonalsForPolicyIteration(const Matrix& M, const SolutionChoice& choice) {
  if (choice.selection != Selection::kUnique && choice.selection != Selection::kLeastElement)
    return std::nullopt;
  std::optional<Tridiagonal> diagonals = TridiagonalOf(M);
  if (diagonals && !IsClearlyMMatrix(*diagonals)) diagonals.reset();
  return diagonals;
}

TridiagonalSolver::TridiagonalSolver(std::shared_ptr<const Tridiagonal> M, MakeGeneral make_general)
    : M_(std::move(M)),
      norm_(MaxAbs(M_->below.cwiseAbs() + M_->diagonal.cwiseAbs() + M_->above.cwiseAbs())),
      iteration_(M_->size()),
      make_general_(std::move(make_general)) {}

LcpVerdict TridiagonalSolver::Solve(const Eigen::Ref<const Vector>& q,
                                    const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                                    Eigen::Ref<Vector> y) {
  account_.pivots = 0;
  account_.method = "policy iteration";
  account_.message.clear();
  by_general_ = false;
  if (iteration_.SolveAgain(*M_, q, tolerance, basis, y, account_.pivots)) return LcpVerdict::kSolved;
  if (SolveFromNothing(q, tolerance, basis, y)) return LcpVerdict::kSolved;
  if (make_general_ && !general_) general_ = make_general_();
  by_general_ = general_ != nullptr;
  if (by_general_) return general_->Solve(q, tolerance, basis, y);
  y.setZero();
  const bool finite = q.allFinite();
  account_.message = finite ? "numbers overflowed on the way" : "q has an entry that is not finite";
  return finite ? LcpVerdict::kSingular : LcpVerdict::kNonFinite;
}

bool TridiagonalSolver::SolveFromNothing(const Eigen::Ref<const Vector>& q,
                                         const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                                         Eigen::Ref<Vector> y) {
  GrowLeastBasis(*M_, q, tolerance, basis, account_.pivots);
  if (iteration_.SolveAgain(*M_, q, tolerance, basis, y, account_.pivots)) return true;
  constexpr double kNormRounding = 5e-13;
  const double rounding = kNormRounding * (MaxAbs(q) + norm_ * MaxAbs(y));
  if (!std::isfinite(rounding)) return false;
  const Vector loose = tolerance.array() + rounding;
  return iteration_.SolveAgain(*M_, q, loose, basis, y, account_.pivots);
}

LcpAccount TridiagonalSolver::Account() const { return by_general_ ? general_->Account() : account_; }

std::unique_ptr<LcpSolver> TridiagonalSolver::Clone() const {
  return std::make_unique<TridiagonalSolver>(M_, make_general_);
}

}  // namespace dlcs
