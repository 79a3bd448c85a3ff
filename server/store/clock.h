// SPDX-License-Identifier: Apache-2.0
// Time as the job service sees it, so that tests can turn the hands.

#ifndef DLCS_SERVER_STORE_CLOCK_H_
#define DLCS_SERVER_STORE_CLOCK_H_

#include <chrono>

namespace dlcs::jobs {

using Duration = std::chrono::microseconds;
using Time = std::chrono::sys_time<Duration>;

// Safe from any thread.
class Clock {
 public:
  virtual ~Clock() = default;
  // The time of day, for what is stored and shown. May jump.
  virtual Time Now() const = 0;
  // Since some start; never jumps. For intervals.
  virtual Duration Elapsed() const = 0;
};

// The machine's own clocks.
const Clock& SystemClock();

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_CLOCK_H_
