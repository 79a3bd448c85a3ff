// SPDX-License-Identifier: Apache-2.0
// What a solution is worth, in one word and one line.

#ifndef DLCS_CORE_PROBLEM_VERDICT_H_
#define DLCS_CORE_PROBLEM_VERDICT_H_

#include <string>
#include <vector>

#include "core/problem/solution.h"

namespace dlcs {

enum class VerdictKind {
  kSolved,          // T was reached, with an estimated error within what was asked for
  kErrorEstimated,  // T was reached, with an estimated error of so much
  kErrorUnknown,    // T was reached; nobody knows how far from the solution
  kNotSolved,       // T was not reached, or not within the error that was asked for
};

struct Verdict {
  VerdictKind kind = VerdictKind::kNotSolved;
  bool success = false;               // the answer may be used: a program that solves exits with 0
  std::string text;                   // one line, for people
  std::vector<std::string> concerns;  // what to beware of, a sentence each
};

// An estimated error above the first is a concern, above the second no success. The same parts of their sizes for what
// the certificate measures.
inline constexpr double kConcern = 0.01;
inline constexpr double kNoSuccess = 0.3;

// Of termination, accuracy and certificate alone. Nothing is kSolved that has a concern.
Verdict JudgeSolution(const Solution& solution);

// "SOLVED", "ERROR_ESTIMATED", "ERROR_UNKNOWN", "NOT_SOLVED".
const char* VerdictName(VerdictKind kind);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_VERDICT_H_
