// SPDX-License-Identifier: Apache-2.0
// The verdict on a solution: one word, one line, and concerns.

#ifndef DLCS_CORE_PROBLEM_VERDICT_H_
#define DLCS_CORE_PROBLEM_VERDICT_H_

#include <string>
#include <vector>

#include "core/problem/solution.h"

namespace dlcs {

enum class VerdictKind {
  kSolved,          // T was reached, and every component is known to the tolerance (core/context/sizes.h)
  kErrorEstimated,  // T was reached. Steps were given, and the error was estimated; or a component missed the tolerance
  kErrorUnknown,    // T was reached, without an estimate of the error
  kNotSolved,       // T was not reached
};

struct Verdict {
  VerdictKind kind = VerdictKind::kNotSolved;
  bool success = false;               // the solution may be used; `dlcs solve` exits with 0
  std::string text;                   // one line
  std::vector<std::string> concerns;  // doubts about the solution, one sentence each
  std::vector<std::string> notes;     // components that are zero or negligible, one sentence each
};

// With an error of more than half of a number, its first digit is not known: no success, even where steps were given.
inline constexpr double kFirstDigit = 0.5;

// Depends on termination, accuracy, certificate, reached limits and the stability of a periodic solution alone. A
// solution with a concern is never kSolved, and never a success. Steps that were given are a success if the error of
// each component is below its size.
Verdict JudgeSolution(const Solution& solution);

// "SOLVED", "ERROR_ESTIMATED", "ERROR_UNKNOWN", "NOT_SOLVED".
const char* VerdictName(VerdictKind kind);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_VERDICT_H_
