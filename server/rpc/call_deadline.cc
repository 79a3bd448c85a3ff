// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/call_deadline.h"

#include <algorithm>

namespace dlcs {
namespace {

// Time to notice the stop, to free the memory of the solve and to send the summary: on two processors with twelve busy
// threads up to a fifth of a second. And time to deliver the trajectory over a busy gigabit link.
constexpr double kMinWindDown_s = 0.25;
constexpr double kMaxWindDown_s = 1;
constexpr double kDeliveryBytesPerSecond = 100e6;

}  // namespace

std::optional<std::chrono::system_clock::time_point> StopTime(std::chrono::system_clock::time_point deadline,
                                                              std::int64_t result_bytes) {
  using SystemClock = std::chrono::system_clock;
  const SystemClock::time_point now = SystemClock::now();
  // gRPC's "no deadline" is the maximum time; a century is equivalent and does not overflow.
  if (deadline > now + std::chrono::hours(24 * 365 * 100)) return std::nullopt;
  const double left_s = std::max(0.0, std::chrono::duration<double>(deadline - now).count());
  const double delivery_s = static_cast<double>(result_bytes) / kDeliveryBytesPerSecond;
  const double margin_s = std::min(std::clamp(left_s / 10, kMinWindDown_s, kMaxWindDown_s) + delivery_s, left_s / 2);
  return deadline - std::chrono::duration_cast<SystemClock::duration>(std::chrono::duration<double>(margin_s));
}

}  // namespace dlcs
