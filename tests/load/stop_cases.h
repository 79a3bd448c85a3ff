// SPDX-License-Identifier: Apache-2.0
// Solves that take long, one for each thing that a stop may have to interrupt.

#ifndef DLCS_TESTS_LOAD_STOP_CASES_H_
#define DLCS_TESTS_LOAD_STOP_CASES_H_

#include <string>
#include <vector>

#include "core/options.h"
#include "core/problem.h"

namespace dlcs::load {

struct StopCase {
  std::string name;  // what most of its time goes to
  Problem problem;
  Options options;
};

// x has 4 components, y has `pairs`; M is positive definite, y switches all the time, T = 1000.
Problem LongProblemOfPairs(Index pairs);

// With matrices of `size` rows, written down entry by entry; on one thread.
std::vector<StopCase> StopCases(Index size);

}  // namespace dlcs::load

#endif  // DLCS_TESTS_LOAD_STOP_CASES_H_
