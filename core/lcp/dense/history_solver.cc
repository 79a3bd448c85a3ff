// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/history_solver.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/lcp/dense/basic_solutions.h"
#include "core/lcp/dense/complementary_solver.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/strong_components.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/matrix_classes/positive_semidefinite.h"

namespace dlcs {
namespace {

Basis PartOf(const Basis& basis, const std::vector<Index>& block) {
  Basis part(block.size());
  for (std::size_t k = 0; k < block.size(); ++k) part[k] = basis[static_cast<std::size_t>(block[k])];
  return part;
}

}  // namespace

HistorySolver::HistorySolver(const Matrix& M) : lcp_(M), point_(lcp_, Elimination::kPivoting), lemke_(M.rows()) {}

HistorySolver::HistorySolver(const Matrix& M, const Matrix& K) : HistorySolver(M + K) {
  std::vector<std::vector<Index>> blocks = StronglyConnected(M);
  if (blocks.size() < 2) return;
  blocks_ = std::move(blocks);
  const auto& [row, column] = lcp_.matrix->scale;
  of_solved_ = row.asDiagonal() * M * column.asDiagonal();
  of_start_ = row.asDiagonal() * K * column.asDiagonal();
  for (const std::vector<Index>& block : blocks_) {
    Matrix of_block = of_solved_(block, block);
    const bool may_fold = !TestPositiveSemidefinite(M(block, block)).yes();
    if (!may_fold) {
      of_block += of_start_(block, block);
      of_start_(block, block).setZero();
    }
    of_blocks_.emplace_back(of_block);
    of_blocks_.back().may_fold_ = may_fold;
  }
}

LcpStatus HistorySolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                               Basis& basis, Eigen::Ref<Vector> y) {
  pivots_ = 0;
  message_.clear();
  y.setZero();
  if (!lcp_.Load(q, tolerance)) {
    message_ = "q has an entry that is not finite";
    return LcpStatus::kNonFinite;
  }
  const auto is_solution = [&] { return point_.Compute(lcp_, basis) && point_.solved(); };
  if (is_solution()) {
    DropIdle(basis);
    point_.Write(lcp_, y);
    return LcpStatus::kSolved;
  }
  start_ = basis;
  if (!blocks_.empty()) {
    if (SolveBlocks(basis) && is_solution() && !IsBetween(basis)) {
      DropIdle(basis);
      point_.Write(lcp_, y);
      return LcpStatus::kSolved;
    }
    basis = start_;
  }
  LemkeEnd end = LemkeEnd::kRay;
  const auto follow = [&](double others) {
    return FollowWithRetries([&](double zero) {
      for (const LemkeTies rule : {LemkeTies::kLexicographic, LemkeTies::kFirst, LemkeTies::kLast}) {
        basis = start_;
        end = lemke_.Follow(lcp_, zero, others, rule, basis);
        pivots_ += lemke_.pivots();
        if (end == LemkeEnd::kBasis && is_solution() && !IsBetween(basis) && !LeavesWithoutNeed(basis)) return true;
      }
      return false;
    });
  };
  if (follow(0) || IsOnlyOne(basis) || follow(1.0 / 1024) || follow(1) || FindAny(basis)) {
    DropIdle(basis);
    point_.Write(lcp_, y);
    return LcpStatus::kSolved;
  }
  message_ = "the path from the solution before does not end in another one";
  return end == LemkeEnd::kPivotLimit ? LcpStatus::kPivotLimit : LcpStatus::kRay;
}

// Leaves out pairs whose y is zero, if one of them has w > 0: the basis is a solution only because rounding was cut,
// and that pair is not active. Keeps the basis of point_ where what is left is none.
void HistorySolver::DropIdle(Basis& basis) {
  Basis busy = basis;
  bool is_idle = false;
  const std::vector<Index>& S = point_.indices();
  for (std::size_t p = 0; p < S.size(); ++p) {
    if (point_.y(static_cast<Index>(p)) != 0) continue;
    busy[static_cast<std::size_t>(S[p])] = 0;
    is_idle = is_idle || point_.is_positive(S[p]);
  }
  if (!is_idle) return;
  if (point_.Compute(lcp_, busy) && point_.solved()) {
    basis = busy;
  } else {
    point_.Compute(lcp_, basis);
  }
}

// Whether a block that may fold has changed its basis, although its previous one would solve it with the other blocks
// as they are now. A path that passes ties, such as those of an open switch, may make such a change without need. On
// entry and on return point_ is that of `basis`.
bool HistorySolver::LeavesWithoutNeed(const Basis& basis) {
  if (blocks_.empty()) return false;
  const Vector y = ScaledY();
  const bool has_start = point_.Compute(lcp_, start_);
  const Vector q = has_start ? Vector(lcp_.q + of_start_ * ScaledY()) : Vector();
  point_.Compute(lcp_, basis);
  if (!has_start) return false;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::vector<Index>& block = blocks_[b];
    const Basis before = PartOf(start_, block);
    if (!of_blocks_[b].may_fold_ || PartOf(basis, block) == before) continue;
    Vector of_others = of_solved_(block, Eigen::all) * y;
    of_others -= of_solved_(block, block) * y(block);
    HistorySolver& solver = of_blocks_[b];
    if (solver.lcp_.Load(q(block) + of_others, lcp_.tolerance(block)) && solver.point_.Compute(solver.lcp_, before) &&
        solver.point_.solved()) {
      return true;
    }
  }
  return false;
}

// y of point_, in the units of lcp_.
Vector HistorySolver::ScaledY() const {
  Vector y = Vector::Zero(lcp_.size());
  const std::vector<Index>& S = point_.indices();
  for (std::size_t p = 0; p < S.size(); ++p) y[S[p]] = point_.y(static_cast<Index>(p));
  return y;
}

// Solves block by block. A block that may fold sees the effect, by K, of the previous solution as if that continued;
// what it changes itself comes later. So a gate sees the current that crosses its threshold, and not the current that
// its switch and valves cause in the same step.
bool HistorySolver::SolveBlocks(Basis& basis) {
  if (!point_.Compute(lcp_, basis)) return false;
  const Vector q = lcp_.q + of_start_ * ScaledY();
  Vector y = Vector::Zero(lcp_.size());
  for (std::size_t b = blocks_.size(); b-- > 0;) {
    const std::vector<Index>& block = blocks_[b];
    Basis part = PartOf(basis, block);
    const Vector of_others = of_solved_(block, Eigen::all) * y;
    Vector of_block(static_cast<Index>(block.size()));
    const LcpStatus verdict = of_blocks_[b].Solve(q(block) + of_others, lcp_.tolerance(block), part, of_block);
    pivots_ += of_blocks_[b].pivots_;
    if (verdict != LcpStatus::kSolved) return false;
    y(block) = of_block;
    for (std::size_t k = 0; k < block.size(); ++k) basis[static_cast<std::size_t>(block[k])] = part[k];
  }
  return true;
}

// Whether the solution of `basis` lies between two folds. There the determinant has the other sign than along the path.
// A path that meets ties, such as two comparators that switch at the same time, may end there.
bool HistorySolver::IsBetween(const Basis& basis) const {
  return SignOfDeterminant(lcp_.M(), start_) * SignOfDeterminant(lcp_.M(), basis) < 0;
}

// Whether there is only one solution; then `basis` is set to its basis. Beyond a fold this is the rule.
bool HistorySolver::IsOnlyOne(Basis& basis) {
  if (lcp_.size() > kMaxSolutionEnumeration) return false;
  const BasicSolutions all = AllBasicSolutions(lcp_.M(), lcp_.q, {}, lcp_.tolerance);
  if (!all.complete || all.solutions.size() != 1) return false;
  std::fill(basis.begin(), basis.end(), std::uint8_t{0});
  for (const Index i : all.solutions.front().basis) basis[static_cast<std::size_t>(i)] = 1;
  return point_.Compute(lcp_, basis) && point_.solved() && !LeavesWithoutNeed(basis);
}

// Ties may end all paths. Where there are no folds every solution has the same w, so any will do.
bool HistorySolver::FindAny(Basis& basis) {
  if (may_fold_) return false;
  ComplementarySolver solver(lcp_.M(), ComplementarySolver::Known::kNothing);
  Vector y(lcp_.size());
  basis = start_;
  const LcpStatus verdict = solver.Solve(lcp_.q, lcp_.tolerance, basis, y);
  pivots_ += solver.Account().pivots;
  return verdict == LcpStatus::kSolved && point_.Compute(lcp_, basis) && point_.solved();
}

int SignOfDeterminant(const Matrix& M, const Basis& basis) {
  const std::vector<Index> indices = IndicesOf(basis);
  if (indices.empty()) return 1;
  const Eigen::FullPivLU<Matrix> factors(Matrix(M(indices, indices)));
  if (!factors.isInvertible()) return 0;
  return factors.determinant() < 0 ? -1 : 1;
}

}  // namespace dlcs
