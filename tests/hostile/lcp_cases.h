// SPDX-License-Identifier: Apache-2.0
// Small LCPs with integer entries, of every class, and the same in other units.

#ifndef DLCS_TESTS_HOSTILE_LCP_CASES_H_
#define DLCS_TESTS_HOSTILE_LCP_CASES_H_

#include <random>
#include <string>
#include <vector>

#include "core/types.h"
#include "tests/hostile/exact_lcp.h"

namespace dlcs::testing {

enum class LcpKind {
  kP,
  kZ,
  kM,
  kPositiveSemidefinite,
  kSkew,
  kCopositive,
  kZeroDiagonal,  // nonnegative
  kHiddenZ,
  kSingularP0,
  kAny,
};
inline constexpr int kNumLcpKinds = 10;

struct LcpCase {
  LcpKind kind;
  IntegerMatrix M;
  IntegerVector q;
};

// The case of a seed; kinds take turns. n <= 5, often degenerate.
LcpCase MakeLcpCase(unsigned seed);

// Powers of two: w_i = 2^row[i] w'_i and y_j = 2^-column[j] y'_j for the integers' w' and y'.
struct LcpUnits {
  std::vector<int> row, column;
};

// Units between 2^-spread and 2^spread; the same for y_i and w_i up to the sign of the exponent, which leaves y_i w_i
// as it was, where `congruent`.
LcpUnits MakeUnits(Index n, int spread, bool congruent, std::mt19937_64& generator);

struct DoubleLcp {
  Matrix M;
  Vector q;
};
DoubleLcp InUnits(const LcpCase& lcp, const LcpUnits& units);

// As a file that `dlcs lcp` reads.
std::string AsFile(const DoubleLcp& lcp);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_HOSTILE_LCP_CASES_H_
