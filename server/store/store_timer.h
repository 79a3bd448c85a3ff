// SPDX-License-Identifier: Apache-2.0
// Timing of store operations.

#ifndef DLCS_SERVER_STORE_STORE_TIMER_H_
#define DLCS_SERVER_STORE_STORE_TIMER_H_

#include <chrono>
#include <functional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dlcs::jobs {

// Called when an operation ("Create") has ended, by the thread that called it. Must not block.
using StoreTimer =
    std::function<void(const char* operation, const absl::Status& status, std::chrono::duration<double> took)>;

inline const absl::Status& StatusOf(const absl::Status& result) { return result; }
template <typename Value>
const absl::Status& StatusOf(const absl::StatusOr<Value>& result) {
  return result.status();
}

// The result of `body()`, an absl::Status or absl::StatusOr; reports its time to `timer`.
template <typename Body>
auto Timed(const StoreTimer& timer, const char* operation, Body&& body) {
  const auto begin = std::chrono::steady_clock::now();
  auto result = body();
  if (timer) timer(operation, StatusOf(result), std::chrono::steady_clock::now() - begin);
  return result;
}

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_STORE_TIMER_H_
