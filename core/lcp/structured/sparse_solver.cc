// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/sparse_solver.h"

#include <utility>

#include "core/lcp/structured/tridiagonal_solver.h"
#include "core/matrix_classes/sparse_class.h"

namespace dlcs {

SparseLcpSolver::SparseLcpSolver(const SparseMatrix& M, Known known)
    : SparseLcpSolver(SparseLcp(M), known == Known::kMMatrix ? Exchange::kBlocks : Exchange::kBlocksThenLeast) {}

SparseLcpSolver::SparseLcpSolver(SparseLcp lcp, Exchange exchange)
    : lcp_(std::move(lcp)), point_(lcp_.size()), exchange_(exchange), ordered_(lcp_.size()) {}

LcpStatus SparseLcpSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                  Basis& basis, Eigen::Ref<Vector> y) {
  // For an M-matrix, S may grow by a layer of neighbors a round: a thousand are a grid of that many points
  // across.
  constexpr int kMaxRounds = 1000;
  account_ = {0, "principal pivoting (sparse)", ""};
  y.setZero();
  if (!lcp_.Load(q, tolerance)) {
    account_.message = "q has an entry that is not finite";
    return LcpStatus::kNonFinite;
  }
  const std::vector<Index>& original = lcp_.matrix->original;
  for (std::size_t i = 0; i < ordered_.size(); ++i) ordered_[i] = basis[original[i]];
  const bool solved = Pivot(kMaxRounds) || PivotLoosely();
  for (std::size_t i = 0; i < ordered_.size(); ++i) basis[original[i]] = ordered_[i];
  if (solved) {
    point_.Write(lcp_, y);
    return LcpStatus::kSolved;
  }
  const bool singular = point_.violations().empty();
  account_.message = singular ? "a basis is singular to working precision" : "principal pivoting did not end";
  return singular ? LcpStatus::kSingular : LcpStatus::kPivotLimit;
}

bool SparseLcpSolver::Pivot(int max_rounds) {
  return PivotPrincipally(lcp_, max_rounds, exchange_, point_, ordered_, account_.pivots);
}

bool SparseLcpSolver::PivotLoosely() {
  constexpr double kTimes = 50;
  constexpr int kRounds = 12;
  const Vector looser = lcp_.tolerance + kTimes * (point_.allowed() - lcp_.tolerance);
  if (point_.allowed().size() != lcp_.size() || !looser.allFinite()) return false;
  lcp_.tolerance = looser;
  return Pivot(kRounds);
}

std::unique_ptr<LcpSolver> SparseLcpSolver::Clone() const {
  return std::unique_ptr<LcpSolver>(new SparseLcpSolver(lcp_, exchange_));
}

std::unique_ptr<LcpSolver> MakeSparseLcpSolver(const SparseMatrix& M, const SolutionChoice& choice) {
  const bool unique = choice.selection == Selection::kUnique;
  if (!unique && choice.selection != Selection::kLeastElement) return nullptr;
  if (std::optional<Tridiagonal> diagonals = TridiagonalOf(M); diagonals && IsClearlyMMatrix(*diagonals)) {
    return std::make_unique<TridiagonalSolver>(std::make_shared<const Tridiagonal>(*std::move(diagonals)), nullptr);
  }
  const bool z = TestZMatrix(M).yes();
  if (!unique && !TestMMatrix(M).yes()) return nullptr;
  return std::make_unique<SparseLcpSolver>(M, z ? SparseLcpSolver::Known::kMMatrix : SparseLcpSolver::Known::kPMatrix);
}

}  // namespace dlcs
