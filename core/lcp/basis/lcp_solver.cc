// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis/lcp_solver.h"

#include <cstddef>

namespace dlcs {

const char* LcpStatusName(LcpStatus verdict) {
  switch (verdict) {
    case LcpStatus::kSolved:
      return "SOLVED";
    case LcpStatus::kInfeasible:
      return "INFEASIBLE";
    case LcpStatus::kRay:
      return "RAY";
    case LcpStatus::kPivotLimit:
      return "PIVOT_LIMIT";
    case LcpStatus::kSingular:
      return "SINGULAR";
    case LcpStatus::kNonFinite:
      return "NON_FINITE";
  }
  return "UNKNOWN";
}

std::vector<Index> IndicesOf(const Basis& basis) {
  std::vector<Index> indices;
  for (std::size_t i = 0; i < basis.size(); ++i) {
    if (basis[i]) indices.push_back(static_cast<Index>(i));
  }
  return indices;
}

LcpStatus BasisSuccessors::Solve(LcpSolver& solver, const Eigen::Ref<const Vector>& q,
                                 const Eigen::Ref<const Vector>& tolerance, Basis& basis, Eigen::Ref<Vector> y) {
  constexpr std::size_t kMost = 256;  // then all are forgotten
  if (const Basis* known = After(basis)) {
    if (solver.SolvesIn(basis, q, tolerance, y)) return LcpStatus::kSolved;
    if (solver.SolvesIn(*known, q, tolerance, y)) {
      basis = *known;
      return LcpStatus::kSolved;
    }
  }
  const Basis before = basis;
  const LcpStatus verdict = solver.Solve(q, tolerance, basis, y);
  if (verdict == LcpStatus::kSolved && basis != before) {
    if (after_.size() == kMost) after_.clear();
    after_[before] = basis;
  }
  return verdict;
}

}  // namespace dlcs
