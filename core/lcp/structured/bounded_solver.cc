// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/bounded_solver.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "core/linalg/sparse/multigrid_solver.h"

namespace dlcs {
namespace {

constexpr Index kBoundsOfABlock = 4096;
// About ten are usual.
constexpr Index kMostChanges = 300;
// Multigrid needs about twenty. If it needs a hundred times as many, it does not suit K.
constexpr Index kMostIterations = 2000;

// The factor by which the residual must fall before the active set is examined. After many changes the equations are
// solved exactly first, as in the exact method, which is known to converge.
double FallBeforeChange(Index changes) { return changes < 10 ? 1e-2 : changes < 20 ? 1e-4 : 0; }

Vector DiagonalOf(const SparseMatrix& K, const std::vector<BoundedUnknown>& bounded) {
  Vector diagonal(static_cast<Index>(bounded.size()));
  for (std::size_t k = 0; k < bounded.size(); ++k) diagonal[k] = K.coeff(bounded[k].index, bounded[k].index);
  return diagonal;
}

}  // namespace

BoundedSolver::BoundedSolver(const SparseMatrix& K, std::vector<BoundedUnknown> bounded, Workers& workers)
    : BoundedSolver(std::make_unique<MultigridSolver>(K, workers), DiagonalOf(K, bounded), bounded, workers) {}

BoundedSolver::BoundedSolver(std::unique_ptr<KrylovSolver> linear, Vector diagonal, std::vector<BoundedUnknown> bounded,
                             Workers& workers)
    : linear_(std::move(linear)),
      bounded_(std::move(bounded)),
      diagonal_(std::move(diagonal)),
      workers_(workers),
      is_fixed_(linear_->matrix().rows(), 0) {}

std::uint64_t BoundedSolver::HashOfFixed() const {
  constexpr std::uint64_t kPrime = 1099511628211U;
  std::uint64_t hash = 14695981039346656037U;  // FNV-1a
  for (const auto& [index, sign] : bounded_) hash = (hash ^ is_fixed_[index]) * kPrime;
  if (linear_->team().is_alone()) return hash;
  constexpr int kExact = 53;  // bits of a double
  std::uint64_t of_all = 0;
  for (const double part : linear_->team().Gather(static_cast<double>(hash >> (64 - kExact)))) {
    of_all = (of_all ^ static_cast<std::uint64_t>(part)) * kPrime;
  }
  return of_all;
}

LcpStatus BoundedSolver::Iterate(double factor) {
  const Index before = linear_->iterations();
  const double target = std::max(1.0, factor * linear_->residual());
  bool is_reduced = linear_->Reduce(target, kMostIterations);
  // Rounding accumulates in the residual of the iteration. Removing it takes one or two more rounds; if it takes more,
  // the tolerance is out of reach.
  constexpr int kMostRepetitions = 5;
  for (int k = 0; is_reduced && linear_->residual() <= 1; ++k) {
    linear_->Refresh();
    if (linear_->residual() <= 1) break;
    is_reduced = k < kMostRepetitions && linear_->Reduce(1, kMostIterations);
  }
  counts_.linear_iterations += linear_->iterations() - before;
  if (is_reduced) return LcpStatus::kSolved;
  return std::isfinite(linear_->residual()) ? LcpStatus::kSingular : LcpStatus::kNonFinite;
}

bool BoundedSolver::ChangeSides(const Vector& b, const Vector& bounds, const ResidualScale& tolerance, Vector& z,
                                Vector& multipliers) {
  const double residual = std::max(1.0, linear_->residual());
  const Index count = multipliers.size();
  linear_->Expand(z);
  std::vector<std::uint8_t> is_wrong(count);
  workers_.ForBlocks(count, kBoundsOfABlock, [&](Index, Index begin, Index end) {
    for (Index k = begin; k < end; ++k) {
      const auto [j, sign] = bounded_[k];
      const double noise = residual * (j < tolerance.split ? tolerance.first : tolerance.second);
      if (is_fixed_[j]) multipliers[k] = sign * (linear_->RowTimes(j, z) - b[j]);
      is_wrong[k] = is_fixed_[j] ? multipliers[k] < -noise : diagonal_[k] * sign * (z[j] - bounds[k]) < -noise;
    }
  });
  bool is_changed = false;
  for (Index k = 0; k < count; ++k) {
    if (!is_wrong[k]) continue;
    const Index j = bounded_[k].index;
    is_fixed_[j] = !is_fixed_[j];
    if (is_fixed_[j]) z[j] = bounds[k];
    if (!is_fixed_[j]) multipliers[k] = 0;
    is_changed = true;
  }
  return linear_->team().Any(is_changed);
}

LcpStatus BoundedSolver::Solve(const Vector& b, const Vector& bounds, const ResidualScale& tolerance, Vector& z,
                               Vector& multipliers) {
  for (Index k = 0; k < multipliers.size(); ++k) {
    const auto [j, sign] = bounded_[k];
    is_fixed_[j] = multipliers[k] - diagonal_[k] * sign * (z[j] - bounds[k]) > 0;
    if (is_fixed_[j]) z[j] = bounds[k];
    if (!is_fixed_[j]) multipliers[k] = 0;
  }
  std::unordered_set<std::uint64_t> solved_sets;
  for (Index changes = 0; changes <= kMostChanges; ++changes) {
    linear_->Fix(is_fixed_);
    linear_->Start(b, z, tolerance);
    for (bool is_changed = false; !is_changed;) {
      if (const LcpStatus verdict = Iterate(FallBeforeChange(changes)); verdict != LcpStatus::kSolved) return verdict;
      const bool is_exact = linear_->residual() <= 1;
      const std::uint64_t set = HashOfFixed();
      is_changed = ChangeSides(b, bounds, tolerance, z, multipliers);
      if (is_exact && is_changed && !solved_sets.insert(set).second) return LcpStatus::kPivotLimit;
      if (is_exact && !is_changed) {
        for (Index k = 0; k < multipliers.size(); ++k) {
          const auto [j, sign] = bounded_[k];
          multipliers[k] = std::max(multipliers[k], 0.0);
          if (sign * (z[j] - bounds[k]) < 0) z[j] = bounds[k];
        }
        return LcpStatus::kSolved;
      }
    }
    ++counts_.changes;
  }
  return LcpStatus::kPivotLimit;
}

}  // namespace dlcs
