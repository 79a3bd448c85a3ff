// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/history_solver.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/lcp/dense/basic_solutions.h"
#include "core/matrix_classes/matrix_class.h"

namespace dlcs {

HistorySolver::HistorySolver(const Matrix& M) : lcp_(M), point_(lcp_, Elimination::kPivoting), lemke_(M.rows()) {}

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
    point_.Write(lcp_, y);
    return LcpStatus::kSolved;
  }
  start_ = basis;
  LemkeEnd end = LemkeEnd::kRay;
  const auto follow = [&](double others) {
    // The tableau may drift, so its basis is checked afresh.
    for (const double zero : {1e-11, 1e-8, 1e-14}) {
      for (const LemkeTies rule : {LemkeTies::kLexicographic, LemkeTies::kFirst, LemkeTies::kLast}) {
        basis = start_;
        end = lemke_.Follow(lcp_, zero, others, rule, basis);
        pivots_ += lemke_.pivots();
        if (end == LemkeEnd::kBasis && is_solution()) return true;
      }
    }
    return false;
  };
  if (follow(0) || IsOnlyOne(basis) || follow(1.0 / 1024) || follow(1)) {
    point_.Write(lcp_, y);
    return LcpStatus::kSolved;
  }
  message_ = "the path from the solution before does not end in another one";
  return end == LemkeEnd::kPivotLimit ? LcpStatus::kPivotLimit : LcpStatus::kRay;
}

// Beyond a fold there is one solution as a rule, whatever the path to it.
bool HistorySolver::IsOnlyOne(Basis& basis) {
  if (lcp_.size() > kMaxSolutionEnumeration) return false;
  const BasicSolutions all = AllBasicSolutions(lcp_.M(), lcp_.q, {}, lcp_.tolerance);
  if (!all.complete || all.solutions.size() != 1) return false;
  std::fill(basis.begin(), basis.end(), std::uint8_t{0});
  for (const Index i : all.solutions.front().basis) basis[static_cast<std::size_t>(i)] = 1;
  return point_.Compute(lcp_, basis) && point_.solved();
}

}  // namespace dlcs
