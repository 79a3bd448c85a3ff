// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/coupled_selection.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/lcp/basis/tolerance.h"
#include "core/lcp/dense/basic_solutions.h"
#include "core/lcp/dense/enumeration.h"

namespace dlcs {

CoupledSelectionSolver::CoupledSelectionSolver(const Matrix& M, const Matrix& K, std::unique_ptr<LcpSolver> selection,
                                               std::unique_ptr<LcpSolver> fallback)
    : M_(M),
      K_(K),
      abs_sum_(M.cwiseAbs() + K.cwiseAbs()),
      coupled_(M + K),
      point_(coupled_, Elimination::kPivoting),
      selection_(std::move(selection)),
      fallback_(std::move(fallback)) {}

std::unique_ptr<LcpSolver> CoupledSelectionSolver::Clone() const {
  return std::make_unique<CoupledSelectionSolver>(M_, K_, selection_->Clone(), fallback_->Clone());
}

LcpStatus CoupledSelectionSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                        Basis& basis, Eigen::Ref<Vector> y) {
  kept_selection_ = true;
  account_ = {.pivots = 0, .method = "Newton on the selected solution", .message = ""};
  if (!coupled_.Load(q, tolerance)) {
    account_.message = "q has an entry that is not finite";
    y.setZero();
    return LcpStatus::kNonFinite;
  }
  const Step step{q, tolerance};
  Vector solution = Vector::Zero(q.size());
  if (Newton(step, basis, solution) || Iterate(step, basis, solution)) {
    y = solution;
    return LcpStatus::kSolved;
  }
  const LcpStatus verdict = fallback_->Solve(q, tolerance, basis, y);
  account_ = fallback_->Account();
  if (verdict != LcpStatus::kSolved) return verdict;
  if (SelectNear(step, y, basis, solution) || SearchSolutions(step, basis, solution)) {
    y = solution;
  } else {
    kept_selection_ = false;
  }
  return verdict;
}

// Sets y to the selected solution at q + K·guess. Returns whether K y = K·guess up to rounding; then it is also the one
// at q + K y.
bool CoupledSelectionSolver::SelectNear(const Step& step, const Vector& guess, Basis& basis, Vector& y) {
  Basis selected = basis;
  if (selection_->Solve(step.q + K_ * guess, step.tolerance, selected, y) != LcpStatus::kSolved) return false;
  account_.pivots += selection_->Account().pivots;
  basis = selected;
  const Vector change = (K_ * (y - guess)).cwiseAbs();
  const Vector allowed = step.tolerance + kRowRounding * (step.q.cwiseAbs() + abs_sum_ * y.cwiseMax(guess).cwiseAbs());
  return (change.array() <= allowed.array()).all();
}

// The guess is the point of the basis in LCP(q, M + K), whether or not it is feasible.
bool CoupledSelectionSolver::Newton(const Step& step, Basis& basis, Vector& y) {
  constexpr int kMaxRounds = 20;
  for (int round = 0; round < kMaxRounds; ++round) {
    if (!point_.Compute(coupled_, basis)) return false;
    Vector guess = Vector::Zero(y.size());
    const std::vector<Index>& S = point_.indices();
    for (std::size_t p = 0; p < S.size(); ++p) {
      guess[S[p]] = coupled_.Original(S[p], point_.y(static_cast<Index>(p)));
    }
    const Basis before = basis;
    if (SelectNear(step, guess, basis, y)) return true;
    if (basis == before) return false;
  }
  return false;
}

bool CoupledSelectionSolver::Iterate(const Step& step, Basis& basis, Vector& y) {
  constexpr int kMaxRounds = 60;
  account_.method = "fixed-point iteration of the selected solution";
  Vector guess = y;
  double last_change = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kMaxRounds; ++round) {
    if (SelectNear(step, guess, basis, y)) return true;
    const double change = (y - guess).lpNorm<Eigen::Infinity>();
    if (!(change < 2 * last_change)) return false;
    last_change = change;
    guess = y;
  }
  return false;
}

bool CoupledSelectionSolver::SearchSolutions(const Step& step, Basis& basis, Vector& y) {
  if (step.q.size() > kMaxEnumerationSize) return false;
  for (const BasicSolution& candidate : AllBasicSolutions(M_ + K_, step.q, {}, step.tolerance).solutions) {
    if (SelectNear(step, candidate.y, basis, y)) return true;
  }
  return false;
}

}  // namespace dlcs
