// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/tridiagonal_solver.h"

#include <cmath>
#include <utility>

#include "core/lcp/structured/tridiagonal_growth.h"

namespace dlcs {

std::optional<Tridiagonal> DiagonalsForPolicyIteration(const Matrix& M, const SolutionChoice& choice) {
  if (choice.selection != Selection::kUnique && choice.selection != Selection::kLeastElement) return std::nullopt;
  std::optional<Tridiagonal> diagonals = TridiagonalOf(M);
  if (diagonals && !IsClearlyMMatrix(*diagonals)) diagonals.reset();
  return diagonals;
}

namespace {

// Fifty times what the rounding of a row is taken for.
Vector LooseRounding(const Tridiagonal& M, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& y) {
  constexpr double kRounding = 5e-13;
  const Index n = M.size();
  Vector size = q.cwiseAbs() + M.diagonal.cwiseProduct(y).cwiseAbs();
  size.tail(n - 1) += M.below.tail(n - 1).cwiseProduct(y.head(n - 1)).cwiseAbs();
  size.head(n - 1) += M.above.head(n - 1).cwiseProduct(y.tail(n - 1)).cwiseAbs();
  return kRounding * size;
}

// M_SS⁻¹ of b_S, zero beside S; without exchanges, as M-matrices allow.
Vector SolveInBasis(const Tridiagonal& M, const Basis& basis, const Vector& b) {
  const Index n = M.size();
  Vector ratio = Vector::Zero(n), x = Vector::Zero(n);
  for (Index i = 0; i < n; ++i) {
    if (!basis[i]) continue;
    const double before = i > 0 ? M.below[i] : 0;
    const double pivot = M.diagonal[i] - (i > 0 ? before * ratio[i - 1] : 0);
    ratio[i] = i + 1 < n ? M.above[i] / pivot : 0;
    x[i] = (b[i] - (i > 0 ? before * x[i - 1] : 0)) / pivot;
  }
  for (Index i = n - 2; i >= 0; --i) {
    if (basis[i]) x[i] -= ratio[i] * x[i + 1];
  }
  return x;
}

// Takes from S what may be there by rounding alone: M_SS⁻¹ >= 0, so y_S = M_SS⁻¹ (-q_S) is summed from numbers of the
// size M_SS⁻¹ |q_S|.
void DropNoise(const Tridiagonal& M, const Eigen::Ref<const Vector>& q, Basis& basis) {
  constexpr double kRounding = 1e-13;
  const Vector y = SolveInBasis(M, basis, -q), size = SolveInBasis(M, basis, q.cwiseAbs());
  for (Index i = 0; i < q.size(); ++i) {
    if (basis[i] && !(y[i] > kRounding * size[i])) basis[i] = 0;
  }
}

}  // namespace

TridiagonalSolver::TridiagonalSolver(std::shared_ptr<const Tridiagonal> M, MakeGeneral make_general)
    : M_(std::move(M)), iteration_(M_->size()), make_general_(std::move(make_general)) {}

LcpStatus TridiagonalSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                    Basis& basis, Eigen::Ref<Vector> y) {
  account_.pivots = 0;
  account_.method = "policy iteration";
  account_.message.clear();
  by_general_ = false;
  if (iteration_.SolveAgain(*M_, q, tolerance, basis, y, account_.pivots)) return LcpStatus::kSolved;
  if (SolveFromNothing(q, tolerance, basis, y)) return LcpStatus::kSolved;
  if (make_general_ && !general_) general_ = make_general_();
  by_general_ = general_ != nullptr;
  if (by_general_) return general_->Solve(q, tolerance, basis, y);
  y.setZero();
  const bool finite = q.allFinite();
  account_.message = finite ? "numbers overflowed on the way" : "q has an entry that is not finite";
  return finite ? LcpStatus::kSingular : LcpStatus::kNonFinite;
}

bool TridiagonalSolver::SolveFromNothing(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                         Basis& basis, Eigen::Ref<Vector> y) {
  GrowLeastBasis(*M_, q, tolerance, basis, account_.pivots);
  if (iteration_.SolveAgain(*M_, q, tolerance, basis, y, account_.pivots)) return true;
  Index known = 0;
  GrowLeastBasis(*M_, q, tolerance, basis, known);
  DropNoise(*M_, q, basis);
  const Basis without_noise = basis;
  if (iteration_.SolveAgain(*M_, q, tolerance, basis, y, account_.pivots)) return true;
  basis = without_noise;
  const Vector loose = tolerance + LooseRounding(*M_, q, SolveInBasis(*M_, basis, -q));
  if (!loose.allFinite()) return false;
  return iteration_.SolveAgain(*M_, q, loose, basis, y, account_.pivots);
}

LcpStats TridiagonalSolver::Account() const { return by_general_ ? general_->Account() : account_; }

std::unique_ptr<LcpSolver> TridiagonalSolver::Clone() const {
  return std::make_unique<TridiagonalSolver>(M_, make_general_);
}

}  // namespace dlcs
