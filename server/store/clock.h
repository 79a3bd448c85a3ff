// SPDX-License-Identifier: Apache-2.0
// The clocks of the job service; tests replace them.

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
  // Wall-clock time, for stored and displayed times. May jump.
  virtual Time Now() const = 0;
  // Monotonic time since an arbitrary start, for intervals.
  virtual Duration Elapsed() const = 0;
};

// The machine's own clocks.
const Clock& SystemClock();

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_CLOCK_H_
