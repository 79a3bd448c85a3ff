// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/coupled_least_element.h"

#include <algorithm>

namespace dlcs {
CoupledLeastElementSolver::CoupledLeastElementSolver(const Matrix& M, const Matrix& K)
    : M_(M),
      K_(K),
      coupled_(M + K),
      point_(coupled_, Elimination::kPivoting),
      m_factor_(M, Elimination::kMMatrix),
      least_(M),
      coupled_least_(IsZMatrix(M + K) ? std::make_unique<LeastElementSolver>(M + K) : nullptr),
      any_(M + K, ComplementarySolver::Known::kNothing),
      shifted_q_(M.rows()),
      newton_y_(M.rows()),
      next_(M.rows(), 0) {}

CoupledLeastElementSolver::CoupledLeastElementSolver(const CoupledLeastElementSolver& other)
    : CoupledLeastElementSolver(other.M_, other.K_) {}

LcpStatus CoupledLeastElementSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                           Basis& basis, Eigen::Ref<Vector> y) {
  kept_selection_ = true;
  account_.pivots = 0;
  account_.method = "Newton on the least element";
  account_.message.clear();
  if (!coupled_.Load(q, tolerance)) {
    account_.message = "q has an entry that is not finite";
    y.setZero();
    return LcpStatus::kNonFinite;
  }
  if (TryBasis(basis, y) || Newton(q, tolerance, basis, y)) return LcpStatus::kSolved;
  return Fallback(q, tolerance, basis, y);
}

bool CoupledLeastElementSolver::TryBasis(const Basis& basis, Eigen::Ref<Vector> y) {
  if (!IsLeast(basis) || !point_.Compute(coupled_, basis) || !point_.solved()) return false;
  point_.Write(coupled_, y);
  return true;
}

bool CoupledLeastElementSolver::Newton(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                       Basis& basis, Eigen::Ref<Vector> y) {
  constexpr int kMaxRounds = 20;
  for (int round = 0; round < kMaxRounds; ++round) {
    newton_y_.setZero();
    if (point_.Compute(coupled_, basis)) {
      const std::vector<Index>& S = point_.indices();
      for (std::size_t p = 0; p < S.size(); ++p) {
        newton_y_[S[p]] = coupled_.Original(S[p], point_.y(static_cast<Index>(p)));
      }
    }
    shifted_q_ = q;
    shifted_q_.noalias() += K_ * newton_y_;
    next_ = basis;
    if (least_.Solve(shifted_q_, tolerance, next_, newton_y_) != LcpStatus::kSolved) return false;
    account_.pivots += least_.Account().pivots;
    const bool repeats = next_ == basis;
    basis = next_;
    if (TryBasis(basis, y)) return true;
    if (repeats) return false;
  }
  return false;
}

LcpStatus CoupledLeastElementSolver::Fallback(const Eigen::Ref<const Vector>& q,
                                              const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                                              Eigen::Ref<Vector> y) {
  if (coupled_least_ != nullptr) {
    std::fill(basis.begin(), basis.end(), std::uint8_t{0});
    const LcpStatus verdict = coupled_least_->Solve(q, tolerance, basis, y);
    if (verdict == LcpStatus::kInfeasible || (verdict == LcpStatus::kSolved && IsLeast(basis))) {
      account_ = coupled_least_->Account();
      return verdict;
    }
  }
  const LcpStatus verdict =
      any_.SolvePreferring([this](const Basis& candidate) { return IsLeast(candidate); }, q, tolerance, basis, y);
  account_ = any_.Account();
  kept_selection_ = verdict != LcpStatus::kSolved || IsLeast(basis);
  return verdict;
}

LcpStats CoupledLeastElementSolver::Account() const { return account_; }

std::unique_ptr<LcpSolver> CoupledLeastElementSolver::Clone() const {
  return std::make_unique<CoupledLeastElementSolver>(*this);
}

}  // namespace dlcs
