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

}  // namespace dlcs
