// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/sparse_solver.h"

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/lcp/basis/basis_point.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/structured/tridiagonal_solver.h"
#include "core/linalg/structured_matrix.h"
#include "core/matrix_classes/sparse_class.h"

namespace dlcs {

namespace {

SparseLcp::Ordered Order(const SparseMatrix& M) {
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> original;  // column i: where index i comes from
  Eigen::AMDOrdering<int>()(M, original);
  SparseLcp::Ordered ordered;
  ordered.M = original.transpose() * M * original;
  ordered.original.assign(original.indices().begin(), original.indices().end());
  ordered.symmetric = IsSymmetric(M);
  return ordered;
}

}  // namespace

SparseLcp::SparseLcp(const SparseMatrix& M)
    : matrix(std::make_shared<const Ordered>(Order(M))), q(Vector::Zero(M.rows())), tolerance(q) {}

bool SparseLcp::Load(const Eigen::Ref<const Vector>& original_q, const Eigen::Ref<const Vector>& original_tolerance) {
  for (Index i = 0; i < size(); ++i) {
    q[i] = original_q[matrix->original[i]];
    tolerance[i] = original_tolerance[matrix->original[i]];
  }
  return q.allFinite();
}

bool SparsePoint::Compute(const SparseLcp& lcp, const Basis& basis) {
  violations_.clear();
  accurate_ = false;
  if (!factor_.Factor(lcp.matrix->M, lcp.matrix->symmetric, basis)) return false;
  const std::vector<Index>& S = factor_.indices();
  y_ = factor_.Solve(-lcp.q(S));
  if (!Evaluate(lcp)) return false;
  if (!accurate_) {
    y_ -= factor_.Solve(w_(S));
    if (!Evaluate(lcp)) return false;
  }
  FindViolations(
      basis, y_, w_, allowed_, [&](Index i, double value) { return Negligible(lcp, i, value); }, violations_);
  return true;
}

bool SparsePoint::Evaluate(const SparseLcp& lcp) {
  const std::vector<Index>& S = factor_.indices();
  if (!y_.allFinite()) return false;
  w_ = lcp.q;
  allowed_ = lcp.q.cwiseAbs();
  for (std::size_t p = 0; p < S.size(); ++p) {
    for (SparseMatrix::InnerIterator it(lcp.matrix->M, S[p]); it; ++it) {
      const double term = it.value() * y_[static_cast<Index>(p)];
      w_[it.row()] += term;
      allowed_[it.row()] += std::abs(term);
    }
  }
  allowed_ = (lcp.tolerance + kRowRounding * allowed_).array() + UnderflowIn(static_cast<Index>(S.size()));
  accurate_ = std::all_of(S.begin(), S.end(), [this](Index i) { return std::abs(w_[i]) <= allowed_[i]; });
  return w_.allFinite();
}

bool SparsePoint::Negligible(const SparseLcp& lcp, Index j, double value) const {
  for (SparseMatrix::InnerIterator it(lcp.matrix->M, j); it; ++it) {
    if (std::abs(it.value() * value) > allowed_[it.row()]) return false;
  }
  return true;
}

void SparsePoint::Write(const SparseLcp& lcp, Eigen::Ref<Vector> y) const {
  y.setZero();
  const std::vector<Index>& S = factor_.indices();
  for (std::size_t p = 0; p < S.size(); ++p) {
    y[lcp.matrix->original[S[p]]] = std::max(0.0, y_[static_cast<Index>(p)]);
  }
}

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
  constexpr int kRounds = 12;
  const Vector looser = lcp_.tolerance + kTimesLooser * (point_.allowed() - lcp_.tolerance);
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
