// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis/lcp_solver.h"

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

}  // namespace dlcs
