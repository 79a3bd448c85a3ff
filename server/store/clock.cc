// SPDX-License-Identifier: Apache-2.0
#include "server/store/clock.h"

namespace dlcs::jobs {
namespace {

class MachineClock final : public Clock {
 public:
  Time Now() const override { return std::chrono::time_point_cast<Duration>(std::chrono::system_clock::now()); }
  Duration Elapsed() const override {
    return std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch());
  }
};

}  // namespace

const Clock& SystemClock() {
  static const MachineClock clock;
  return clock;
}

}  // namespace dlcs::jobs
