// SPDX-License-Identifier: Apache-2.0
// When to stop a solve so that its result arrives before the deadline of the call.

#ifndef DLCS_SERVER_RPC_CALL_DEADLINE_H_
#define DLCS_SERVER_RPC_CALL_DEADLINE_H_

#include <chrono>
#include <cstdint>
#include <optional>

namespace dlcs {

// Earlier than `deadline` by a tenth of the time left (at least a quarter of a second, at most one second), and by what
// the delivery of `result_bytes` may take, together by at most half of the time left. Absent if the call has no
// deadline.
std::optional<std::chrono::system_clock::time_point> StopTime(std::chrono::system_clock::time_point deadline,
                                                              std::int64_t result_bytes);

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_CALL_DEADLINE_H_
