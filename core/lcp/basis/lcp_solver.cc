// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis/lcp_solver.h"

namespace dlcs {

const char* LcpVerdictName(LcpVerdict verdict) {
  switch (verdict) {
    case LcpVerdict::kSolved:
      return "SOLVED";
    case LcpVerdict::kInfeasible:
      return "INFEASIBLE";
    case LcpVerdict::kRay:
      return "RAY";
    case LcpVerdict::kPivotLimit:
      return "PIVOT_LIMIT";
    case LcpVerdict::kSingular:
      return "SINGULAR";
    case LcpVerdict::kNonFinite:
      return "NON_FINITE";
  }
  return "UNKNOWN";
}

}  // namespace dlcs
