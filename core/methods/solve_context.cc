// SPDX-License-Identifier: Apache-2.0

#include "core/methods/solve_context.h"

#include "core/linalg/norms.h"

namespace dlcs {

bool FailLcp(SolveContext& context, LcpVerdict verdict, double time, const std::string& which) {
  const std::string at = which + " at t = " + FormatNumber(time);
  switch (verdict) {
    case LcpVerdict::kInfeasible:
      return context.Fail(Termination::kInfeasible, time, at + " has no solution.");
    case LcpVerdict::kRay:
      return context.Fail(Termination::kUnsupported, time,
                          at + ": Lemke's method ended in a ray. No solution was found, and for this class of "
                               "matrix that is no proof that there is none; a smaller step may help.");
    case LcpVerdict::kPivotLimit:
      return context.Fail(Termination::kIterationLimit, time, at + ": the limit of pivots was reached.");
    case LcpVerdict::kSingular:
      return context.Fail(Termination::kIterationLimit, time,
                          at + ": the basis is singular to working precision.");
    case LcpVerdict::kNonFinite:
      return context.Fail(Termination::kNonFinite, time,
                          "The state is no longer finite at t = " + FormatNumber(time) +
                              ": it grew beyond the range of numbers, or the step is too long.");
    case LcpVerdict::kSolved:
      break;
  }
  return context.Fail(Termination::kNotSolved, time, at + ": solved, but reported as failed.");
}

Vector SizeOfSums(const StructuredMatrix& N, const Eigen::Ref<const Matrix>& x, const Eigen::Ref<const Matrix>& g) {
  return N.AbsTimes(RowMaxAbs(x)) + RowMaxAbs(g);
}

}  // namespace dlcs
