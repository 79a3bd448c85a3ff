// SPDX-License-Identifier: Apache-2.0
// Long work, one case for each part of the code that a stop may have to interrupt.

#ifndef DLCS_TESTS_LOAD_STOP_CASES_H_
#define DLCS_TESTS_LOAD_STOP_CASES_H_

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/problem/options.h"
#include "core/problem/problem.h"

namespace dlcs::load {

struct StopCase {
  std::string name;  // the part that takes most of its time
  Problem problem;
  Options options;
};

// x has 4 components, y has `pairs`; M is positive definite, y switches all the time, T = 1000.
Problem LongProblemOfPairs(Index pairs);

// With matrices of `size` rows, written down entry by entry; on one thread.
std::vector<StopCase> StopCases(Index size);

struct StoppableWork {
  std::string name;
  // Runs the work. Returns whether it ended correctly, stopped or complete.
  std::function<bool(std::stop_token stop)> run;
};

// StopCases(), and other kinds of work: analyses, an ensemble, a nonlinear system.
std::vector<StoppableWork> StoppableWorks(Index size);

}  // namespace dlcs::load

#endif  // DLCS_TESTS_LOAD_STOP_CASES_H_
