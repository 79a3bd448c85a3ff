// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/tridiagonal_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/lcp/basis/tolerance.h"

namespace dlcs {

namespace {

// A run of neighbors in S as seen from outside: y, and the entries of (M_SS)⁻¹, at its first and last index.
struct Run {
  Index first = 0, last = -1;
  double y_first = 0, y_last = 0;
  double first_first = 0, first_last = 0, last_first = 0, last_last = 0;
};

class Growth {
 public:
  Growth(const Tridiagonal& M, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
         Basis& basis)
      : M_(M), q_(q), tolerance_(tolerance), basis_(basis), runs_(M.size()) {}

  Index Grow() {
    Index entered = 0;
    for (Index j = 0; j < M_.size(); ++j) {
      candidates_.push_back(j);
      while (!candidates_.empty()) {
        const Index candidate = candidates_.back();
        candidates_.pop_back();
        if (!IsViolated(candidate)) continue;
        ++entered;
        Enter(candidate);
      }
    }
    return entered;
  }

 private:
  // The runs that end before and begin behind j; empty ones where there are none.
  Run LeftOf(Index j) const { return j > 0 && basis_[j - 1] ? runs_[j - 1] : Run{}; }
  Run RightOf(Index j) const { return j + 1 < M_.size() && basis_[j + 1] ? runs_[j + 1] : Run{}; }

  bool IsViolated(Index j) const {
    if (j < 0 || j >= M_.size() || basis_[j]) return false;
    const double from_left = M_.below[j] * LeftOf(j).y_last;
    const double from_right = M_.above[j] * RightOf(j).y_first;
    const double size = std::abs(q_[j]) + std::abs(from_left) + std::abs(from_right);
    return q_[j] + from_left + from_right < -(tolerance_[j] + kRowRounding * size);
  }

  // Joins j and the runs beside it, by bordering: s is the Schur complement of j. What y_j = 1 adds at the
  // first index is `to_first`, what a right-hand side of 1 there adds to the equation of j is -`from_first`;
  // likewise for the last.
  void Enter(Index j) {
    const Run left = LeftOf(j), right = RightOf(j);
    const bool has_left = left.last >= left.first, has_right = right.last >= right.first;
    const double above_left = has_left ? M_.above[j - 1] : 0, below_right = has_right ? M_.below[j + 1] : 0;
    const double s =
        M_.diagonal[j] - M_.below[j] * left.last_last * above_left - M_.above[j] * right.first_first * below_right;
    const double y = -(q_[j] + M_.below[j] * left.y_last + M_.above[j] * right.y_first) / s;
    const double to_first = has_left ? -left.first_last * above_left : 1;
    const double to_last = has_right ? -right.last_first * below_right : 1;
    const double from_first = has_left ? -M_.below[j] * left.last_first : 1;
    const double from_last = has_right ? -M_.above[j] * right.first_last : 1;

    Run joined;
    joined.first = has_left ? left.first : j;
    joined.last = has_right ? right.last : j;
    joined.y_first = left.y_first + to_first * y;
    joined.y_last = right.y_last + to_last * y;
    joined.first_first = left.first_first + to_first * from_first / s;
    joined.first_last = to_first * from_last / s;
    joined.last_first = to_last * from_first / s;
    joined.last_last = right.last_last + to_last * from_last / s;
    basis_[j] = 1;
    runs_[joined.first] = runs_[joined.last] = joined;
    candidates_.push_back(joined.last + 1);
    candidates_.push_back(joined.first - 1);
  }

  const Tridiagonal& M_;
  const Eigen::Ref<const Vector>& q_;
  const Eigen::Ref<const Vector>& tolerance_;
  Basis& basis_;
  std::vector<Run> runs_;  // at the first and the last index of each
  std::vector<Index> candidates_;
};

}  // namespace

void GrowLeastBasis(const Tridiagonal& M, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                    Basis& basis, Index& pivots) {
  std::fill(basis.begin(), basis.end(), std::uint8_t{0});
  pivots += Growth(M, q, tolerance, basis).Grow();
}

std::optional<Tridiagonal> DiagonalsForPolicyIteration(const Matrix& M, const SolutionChoice& choice) {
  if (choice.selection != Selection::kUnique && choice.selection != Selection::kLeastElement) return std::nullopt;
  std::optional<Tridiagonal> diagonals = TridiagonalOf(M);
  if (diagonals && !IsClearlyMMatrix(*diagonals)) diagonals.reset();
  return diagonals;
}

namespace {

// Returns kTimesLooser times the assumed rounding of each row.
Vector LooseRounding(const Tridiagonal& M, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& y) {
  const Index n = M.size();
  Vector size = q.cwiseAbs() + M.diagonal.cwiseProduct(y).cwiseAbs();
  size.tail(n - 1) += M.below.tail(n - 1).cwiseProduct(y.head(n - 1)).cwiseAbs();
  size.head(n - 1) += M.above.head(n - 1).cwiseProduct(y.tail(n - 1)).cwiseAbs();
  return kTimesLooser * kRowRounding * size;
}

// Returns M_SS⁻¹ b_S, and zero outside S. An M-matrix needs no row exchanges.
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
  const Vector y = SolveInBasis(M, basis, -q), size = SolveInBasis(M, basis, q.cwiseAbs());
  for (Index i = 0; i < q.size(); ++i) {
    if (basis[i] && !(y[i] > kLcpTolerance * size[i])) basis[i] = 0;
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
