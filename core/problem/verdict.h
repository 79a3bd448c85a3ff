// SPDX-License-Identifier: Apache-2.0
// The verdict on a solution: one word, one line, and concerns.

#ifndef DLCS_CORE_PROBLEM_VERDICT_H_
#define DLCS_CORE_PROBLEM_VERDICT_H_

#include <string>
#include <vector>

#include "core/problem/solution.h"

namespace dlcs {

enum class VerdictKind {
  kSolved,          // T was reached, and the estimated error is within the tolerance
  kErrorEstimated,  // T was reached, and the error was estimated
  kErrorUnknown,    // T was reached, without an estimate of the error
  kNotSolved,       // T was not reached, or not within the error tolerance set by the caller
};

struct Verdict {
  VerdictKind kind = VerdictKind::kNotSolved;
  bool success = false;               // the solution may be used; `dlcs solve` exits with 0
  std::string text;                   // one line
  std::vector<std::string> concerns;  // doubts about the solution, one sentence each
};

// An estimated error above kConcern is a concern; above kNoSuccess it is not a success. The same limits hold for the
// relative residuals of the certificate.
inline constexpr double kConcern = 0.01;
inline constexpr double kNoSuccess = 0.3;

// Depends on termination, accuracy, certificate, reached limits and the stability of a periodic solution alone. A
// solution with a concern is never kSolved.
Verdict JudgeSolution(const Solution& solution);

// "SOLVED", "ERROR_ESTIMATED", "ERROR_UNKNOWN", "NOT_SOLVED".
const char* VerdictName(VerdictKind kind);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_VERDICT_H_
