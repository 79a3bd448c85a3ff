// SPDX-License-Identifier: Apache-2.0
#include "server/store/clock.h"

#include <cstdlib>

namespace dlcs::jobs {
namespace {

// Tests set a number of seconds by which the clock of this process is ahead.
Duration OffsetOfTests() {
  const char* const seconds = std::getenv("DLCS_TEST_CLOCK_OFFSET_S");
  return std::chrono::seconds(seconds == nullptr ? 0 : std::atoll(seconds));
}

class MachineClock final : public Clock {
 public:
  Time Now() const override {
    return std::chrono::time_point_cast<Duration>(std::chrono::system_clock::now()) + offset_;
  }
  Duration Elapsed() const override {
    return std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch());
  }

 private:
  const Duration offset_ = OffsetOfTests();
};

}  // namespace

const Clock& SystemClock() {
  static const MachineClock clock;
  return clock;
}

}  // namespace dlcs::jobs
