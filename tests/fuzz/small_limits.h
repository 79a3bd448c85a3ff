// SPDX-License-Identifier: Apache-2.0
// Limits with which a fuzz target runs thousands of requests per second.

#ifndef DLCS_TESTS_FUZZ_SMALL_LIMITS_H_
#define DLCS_TESTS_FUZZ_SMALL_LIMITS_H_

#include "server/session/request_check.h"

namespace dlcs::fuzz {

// For requests that are read and validated, but not solved.
inline SessionLimits SmallLimits() {
  SessionLimits limits;
  limits.max_states = 20'000;
  limits.max_dense_states = 50;
  limits.max_constraints = 50;
  limits.max_steps = 1'000'000;
  limits.max_result_bytes = 10'000'000;
  limits.max_answer_bytes = 1'000'000;
  limits.max_memory_bytes = 1e8;
  limits.max_members = 100;
  limits.max_threads = 1;
  return limits;
}

// For requests that are solved.
inline SessionLimits TinyLimits() {
  SessionLimits limits = SmallLimits();
  limits.max_states = 16;
  limits.max_dense_states = 5;
  limits.max_constraints = 5;
  limits.max_steps = 40;
  limits.max_result_bytes = 20'000;
  limits.max_memory_bytes = 1e7;
  limits.max_members = 5;
  return limits;
}

}  // namespace dlcs::fuzz

#endif  // DLCS_TESTS_FUZZ_SMALL_LIMITS_H_
