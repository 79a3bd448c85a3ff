// SPDX-License-Identifier: Apache-2.0
// A clock that stands still until it is moved.

#ifndef DLCS_TESTS_SERVER_STORE_MANUAL_CLOCK_H_
#define DLCS_TESTS_SERVER_STORE_MANUAL_CLOCK_H_

#include <atomic>
#include <cstdint>

#include "server/store/clock.h"

namespace dlcs::jobs::testing {

class ManualClock final : public Clock {
 public:
  Time Now() const override { return Time(Duration(1'700'000'000'000'000 + elapsed_)); }
  Duration Elapsed() const override { return Duration(elapsed_); }
  void Advance(Duration duration) { elapsed_ += duration.count(); }

 private:
  std::atomic<std::int64_t> elapsed_ = 1;
};

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_STORE_MANUAL_CLOCK_H_
