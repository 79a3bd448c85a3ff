// SPDX-License-Identifier: Apache-2.0
#include "core/problem/solution.h"

namespace dlcs {

std::vector<double> NewtonRecord::Quotients() const {
  std::vector<double> quotients;
  for (std::size_t k = 1; k < residuals.size() && residuals[k - 1] > 0; ++k) {
    quotients.push_back(residuals[k] / residuals[k - 1]);
  }
  return quotients;
}

const char* TerminationName(Termination termination) {
  switch (termination) {
    case Termination::kNotSolved:
      return "NOT_SOLVED";
    case Termination::kReachedEnd:
      return "REACHED_END";
    case Termination::kInfeasible:
      return "INFEASIBLE";
    case Termination::kDiverged:
      return "DIVERGED";
    case Termination::kIterationLimit:
      return "ITERATION_LIMIT";
    case Termination::kInconsistentState:
      return "INCONSISTENT_STATE";
    case Termination::kNotPeriodic:
      return "NOT_PERIODIC";
    case Termination::kUnsupported:
      return "UNSUPPORTED";
    case Termination::kNonFinite:
      return "NON_FINITE";
    case Termination::kCancelled:
      return "CANCELLED";
  }
  return "UNKNOWN";
}

std::string NumberedName(const Component& component) {
  const char* const letter[] = {"x", "y", "w", "z"};
  return letter[static_cast<int>(component.kind)] + ("[" + std::to_string(component.index) + "]");
}

}  // namespace dlcs
