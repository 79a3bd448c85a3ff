// SPDX-License-Identifier: Apache-2.0
// Small requests for the tests of the service.

#ifndef DLCS_TESTS_SERVER_TEST_REQUESTS_H_
#define DLCS_TESTS_SERVER_TEST_REQUESTS_H_

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::testing {

v1::Matrix DenseMatrix(int rows, int columns, std::initializer_list<double> row_major_values);

// x' = -x + y + sin 2t, 0 <= y ⟂ x + y + cos 3t - 1/2 >= 0, x(0) = 1, T = 10: a P-matrix, y switches on and
// off about ten times.
v1::SolveRequest SwitchingRequest(std::int64_t steps);

// The same with one window per step and several iterates in each: as many events as an engine can make.
v1::SolveRequest ChattyRequest(std::int64_t steps);

// How many times slower the engine is than in a release build, roughly: tests that race with time or make
// very many events ask for that many times less.
#ifdef NDEBUG
inline constexpr std::int64_t kSlowness = 1;
#else
inline constexpr std::int64_t kSlowness = 20;
#endif

// The same, solved step by step: a few hundred thousand `steps` take about a second.
v1::SolveRequest SteppingRequest(std::int64_t steps);

// Fifty of them in one problem, solved step by step, which takes minutes on any machine. The trajectory has the time 0
// alone.
v1::SolveRequest EndlessRequest();

// Checks that the numbers of `events` are 1, 2, 3, ..., each of an event or inside a gap, that `accepted` is first, and
// that the summary is last and occurs once. Returns what is wrong, or an empty text.
std::string WhatIsWrongWithOrder(const std::vector<v1::SolveEvent>& events);

// Counts the events of one kind.
int Count(const std::vector<v1::SolveEvent>& events, v1::SolveEvent::KindCase kind);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_TEST_REQUESTS_H_
