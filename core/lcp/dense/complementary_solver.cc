// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/complementary_solver.h"

#include <algorithm>

#include "core/lcp/basis/principal_pivoting.h"
#include "core/lcp/dense/bimatrix_games.h"
#include "core/lcp/dense/enumeration.h"
#include "core/lcp/dense/feasibility.h"
#include "core/matrix_classes/positive_semidefinite.h"
#include "core/matrix_classes/s_matrix.h"

namespace dlcs {
namespace {

// The number of rounds of principal pivoting on a matrix of no known class. They are enough if the matrix is nearly a
// P-matrix.
constexpr int kAttempts = 12;

}  // namespace

ComplementarySolver::ComplementarySolver(const Matrix& M, Known known)
    : known_(known),
      exchange_(known == Known::kMMatrix ? Exchange::kBlocks : Exchange::kBlocksThenLeast),
      lcp_(M),
      point_(lcp_, known == Known::kMMatrix ? Elimination::kMMatrix : Elimination::kPivoting) {}

LcpStatus ComplementarySolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                     Basis& basis, Eigen::Ref<Vector> y) {
  pivots_ = 0;
  message_.clear();
  method_ = "principal pivoting";
  if (!lcp_.Load(q, tolerance)) return Fail(LcpStatus::kNonFinite, "q has an entry that is not finite", y);
  // Small problems of no class are left to Lemke's method, which is as fast there and finds more.
  const bool pivots = known_ != Known::kNothing || lcp_.size() > kMaxEnumerationSize;
  const int max_rounds = known_ != Known::kNothing ? 30 + 4 * static_cast<int>(lcp_.size()) : kAttempts;
  const bool solved = pivots ? PivotPrincipally(lcp_, max_rounds, exchange_, point_, basis, pivots_)
                             : point_.Compute(lcp_, basis) && point_.solved();
  if (solved) {
    point_.Write(lcp_, y);
    return LcpStatus::kSolved;
  }
  return SolveFromScratch(basis, y);
}

bool ComplementarySolver::SolvesIn(const Basis& basis, const Eigen::Ref<const Vector>& q,
                                   const Eigen::Ref<const Vector>& tolerance, Eigen::Ref<Vector> y) {
  if (!lcp_.Load(q, tolerance) || !point_.Compute(lcp_, basis) || !point_.solved()) return false;
  point_.Write(lcp_, y);
  return true;
}

LcpStatus ComplementarySolver::SolveFromScratch(Basis& basis, Eigen::Ref<Vector> y) {
  std::optional<BimatrixGames> games;
  if (known_ == Known::kNothing) games = FindBimatrixGames(lcp_);
  if (games && games->is_infeasible) {
    method_ = "signs of q and M";
    return Fail(LcpStatus::kInfeasible, "where q and a row of M are positive, y is zero; that makes another w negative",
                y);
  }
  // Nonnegative games have solutions that Lemke's method often does not find. Others may be linear programs, which it
  // decides.
  if (games && games->is_nonnegative && SolveGames(*games, basis, y)) return LcpStatus::kSolved;
  method_ = "Lemke";
  if (!lemke_) lemke_.emplace(lcp_.size());
  LemkeEnd end = LemkeEnd::kRay;
  std::optional<LcpStatus> verdict;
  // Stops where rounding has not ended the path.
  FollowWithRetries([&](double zero) {
    end = lemke_->Run(lcp_, zero, basis);
    pivots_ += lemke_->pivots();
    if (end == LemkeEnd::kBasis && Polish(basis)) {
      point_.Write(lcp_, y);
      verdict = LcpStatus::kSolved;
      return true;
    }
    if (end == LemkeEnd::kRay && ProvesInfeasible(lcp_, lemke_->ray())) {
      verdict =
          Fail(LcpStatus::kInfeasible,
               "no y >= 0 has q + M y >= 0: some v >= 0 has Mᵀv <= 0 and qᵀv < 0 (found by Lemke's method)", y);
      return true;
    }
    if (end == LemkeEnd::kPivotLimit) return true;
    // For a positive semidefinite matrix a ray must prove infeasibility, for a P-matrix there is none.
    const bool may_be_rounding = end == LemkeEnd::kBasis || known_ != Known::kNothing ||
                                 TestPositiveSemidefinite(lcp_.matrix->Congruent()).yes();
    return !may_be_rounding;
  });
  if (verdict) return *verdict;
  if (games && !games->is_nonnegative && SolveGames(*games, basis, y)) return LcpStatus::kSolved;
  if (lcp_.size() <= kMaxEnumerationSize || end == LemkeEnd::kRay) return AfterRay(basis, y);
  if (end == LemkeEnd::kPivotLimit) {
    return Fail(LcpStatus::kPivotLimit, "Lemke's method did not end within its pivots", y);
  }
  return Fail(LcpStatus::kSingular, "the basis found is singular to working precision", y);
}

// The basis that Lemke's method ends with may be off by a few indices where y or w are nearly zero.
bool ComplementarySolver::Polish(Basis& basis) {
  constexpr int kRounds = 5;
  return PivotPrincipally(lcp_, kRounds, exchange_, point_, basis, pivots_);
}

bool ComplementarySolver::SolveGames(const BimatrixGames& games, Basis& basis, Eigen::Ref<Vector> y) {
  if (!SolveByLemkeHowson(lcp_, games, basis, pivots_) || !Polish(basis)) return false;
  method_ = "Lemke-Howson";
  point_.Write(lcp_, y);
  return true;
}

LcpStatus ComplementarySolver::AfterRay(Basis& basis, Eigen::Ref<Vector> y) {
  // Two linear inequalities that all but contradict each other are no proof where the enumeration decides better.
  const bool enumerates = lcp_.size() <= kMaxEnumerationSize;
  const double rounding = enumerates ? kFewUlps : kWorkingPrecision;
  const bool always_feasible = ImageIsPositive(lcp_.M(), Vector::Ones(lcp_.size()));
  if (!always_feasible &&
      FindFeasiblePoint(lcp_.M(), lcp_.q, lcp_.tolerance, rounding).answer == Feasibility::kInfeasible) {
    method_ = "linear programming";
    return Fail(LcpStatus::kInfeasible, "no y >= 0 has q + M y >= 0", y);
  }
  if (enumerates) {
    method_ = "enumeration";
    BasisPoint point(lcp_, Elimination::kPivoting);
    const LcpStatus verdict = Enumerate(
        lcp_, [](const Basis&) { return true; }, point, basis, y);
    if (verdict == LcpStatus::kSolved) return verdict;
    if (verdict == LcpStatus::kInfeasible) return Fail(verdict, "no choice of active constraints solves it", y);
    return Fail(verdict, "no solution found, but a nearly singular basis may have one", y);
  }
  return Fail(LcpStatus::kRay, "Lemke's method ended in a ray: no solution found, and not proven that there is none",
              y);
}

LcpStatus ComplementarySolver::SolvePreferring(const std::function<bool(const Basis&)>& preferred,
                                               const Eigen::Ref<const Vector>& q,
                                               const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                                               Eigen::Ref<Vector> y) {
  std::fill(basis.begin(), basis.end(), std::uint8_t{0});
  const LcpStatus verdict = Solve(q, tolerance, basis, y);
  if (verdict != LcpStatus::kSolved || preferred(basis) || lcp_.size() > kMaxEnumerationSize) return verdict;
  Basis better = basis;
  Vector better_y(y.size());
  if (Enumerate(lcp_, preferred, point_, better, better_y) == LcpStatus::kSolved && preferred(better)) {
    basis = better;
    y = better_y;
    method_ = "enumeration";
  }
  return verdict;
}

LcpStatus ComplementarySolver::Fail(LcpStatus verdict, const char* why, Eigen::Ref<Vector> y) {
  y.setZero();
  message_ = why;
  return verdict;
}

std::unique_ptr<LcpSolver> ComplementarySolver::Clone() const { return std::make_unique<ComplementarySolver>(*this); }

}  // namespace dlcs
